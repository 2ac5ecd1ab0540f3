// What comes over the line goes to the parts that show it.
import "./stop.js";
import { seen, showPicture } from "./camera.js";
import { showOnline, showState } from "./controls.js";
import { prepareFinger, showFinger } from "./finger.js";
import { Link } from "./link.js";
import { showRows } from "./plots.js";
import { STATE } from "./wire.js";

document.body.classList.add(`mode-${document.body.dataset.mode}`);
prepareFinger();
new Link((news) => {
  if (STATE in news) showState(news[STATE]);
  showRows(news);
  showPicture(news);
  showFinger(news);
}, showOnline);
window.tubefoot = { seen };
