"""Sheets: the calibration board and a finger's markers at true scale, as SVG and as PDF.

Both are drawn from the same black rectangles in millimetres. A ruler of 100 mm on each sheet shows whether
the printer kept the scale.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.records import write_whole
from tubefoot.vision.board import Board
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.marker import marker_cells

PAPERS = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
"""Paper sizes, upright [mm]."""

POINTS_A_MM = 72 / 25.4
MARGIN = 8.0
RULER = 100.0

Rectangle = tuple[float, float, float, float]


@dataclass
class Sheet:
    """Black rectangles, thin lines and words on paper; x right and y down from its top left [mm].

    width, height : paper [mm]
    """

    width: float
    height: float
    black: list[Rectangle] = field(default_factory=list)
    lines: list[Rectangle] = field(default_factory=list)
    words: list[tuple[float, float, str]] = field(default_factory=list)

    def add_cells(self, cells: NDArray[np.float32], x: float, y: float, cell: float) -> None:
        """Draw the black cells of a pattern, runs of a row as one rectangle.

        cells : (rows, columns), 1 is white
        x, y : top left corner [mm]
        cell : side of a cell [mm]
        """
        for row, values in enumerate(cells):
            edges = np.flatnonzero(np.diff(np.concatenate([[1.0], values, [1.0]])) != 0)
            for start, end in zip(edges[::2], edges[1::2], strict=True):
                self.black.append((x + start * cell, y + row * cell, (end - start) * cell, cell))

    def add_outline(self, x: float, y: float, width: float, height: float) -> None:
        """Draw a thin grey line to cut along.

        x, y : top left corner [mm]
        width, height : of the piece [mm]
        """
        self.lines.append((x, y, width, height))

    def add_ruler(self, x: float, y: float) -> None:
        """Draw a bar of 100 mm and what it is for.

        x, y : its left end [mm]
        """
        self.black.append((x, y, RULER, 0.6))
        self.black += [(x, y - 2, 0.3, 2), (x + RULER - 0.3, y - 2, 0.3, 2)]
        self.words.append((x, y + 5, "This bar is 100 mm long. If not, print again at 100 % (actual size)."))

    def svg(self) -> str:
        """The sheet as SVG, one user unit a millimetre."""
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width:g}mm" height="{self.height:g}mm" '
            f'viewBox="0 0 {self.width:g} {self.height:g}">',
            f'<rect width="{self.width:g}" height="{self.height:g}" fill="#fff"/>',
        ]
        crisp = 'fill="#000" shape-rendering="crispEdges"'
        thin = 'fill="none" stroke="#bbb" stroke-width="0.15"'
        for rectangles, style in ((self.black, crisp), (self.lines, thin)):
            parts += [
                f'<rect x="{x:.4f}" y="{y:.4f}" width="{width:.4f}" height="{height:.4f}" {style}/>'
                for x, y, width, height in rectangles
            ]
        style = 'font-family="Helvetica, Arial, sans-serif" font-size="3"'
        parts += [f'<text x="{x:.3f}" y="{y:.3f}" {style}>{word}</text>' for x, y, word in self.words]
        return "\n".join([*parts, "</svg>", ""])

    def pdf(self) -> bytes:
        """The sheet as PDF with one page of its size."""
        drawing = ["0 g"]
        drawing += [self._pdf_rectangle(rectangle) + " f" for rectangle in self.black]
        drawing.append("0.73 G 0.4 w")
        drawing += [self._pdf_rectangle(rectangle) + " S" for rectangle in self.lines]
        for x, y, word in self.words:
            escaped = word.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
            place = f"{x * POINTS_A_MM:.3f} {(self.height - y) * POINTS_A_MM:.3f}"
            drawing.append(f"BT /F1 8.5 Tf {place} Td ({escaped}) Tj ET")
        content = "\n".join(drawing).encode("latin-1", "replace")
        box = f"0 0 {self.width * POINTS_A_MM:.4f} {self.height * POINTS_A_MM:.4f}"
        objects = [
            b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            f"<< /Type /Page /Parent 2 0 R /MediaBox [{box}] /Contents 4 0 R "
            "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
            f"<< /Length {len(content)} >>\nstream\n".encode() + content + b"\nendstream",
            b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        ]
        return _pdf_file(objects)

    def _pdf_rectangle(self, rectangle: Rectangle) -> str:
        x, y, width, height = rectangle
        numbers = (x, self.height - y - height, width, height)
        return " ".join(f"{number * POINTS_A_MM:.4f}" for number in numbers) + " re"

    def save(self, stem: Path) -> list[Path]:
        """The two files, after writing them.

        stem : path without suffix
        """
        return [
            write_whole(stem.with_name(stem.name + ".svg"), self.svg()),
            write_whole(stem.with_name(stem.name + ".pdf"), self.pdf()),
        ]


def board_sheet(board: Board, paper: str = "a4") -> Sheet:
    """The calibration board on a sheet.

    board : what to print; one that does not fit raises ConfigError
    paper : one of PAPERS
    """
    width, height = _paper(paper)
    quiet = board.settings.square_mm / 4
    if board.width + 2 * quiet > width or board.height + 2 * quiet + 14 > height:
        raise ConfigError(
            f"the board is {board.width:g} x {board.height:g} mm and does not fit on {paper} "
            f"({width:g} x {height:g} mm) with its margin; use smaller or fewer squares, or larger paper"
        )
    sheet = Sheet(width, height)
    count = board.cells.shape[1]
    left, top = (width - board.width) / 2, (height - 12 - board.height) / 2
    sheet.add_cells(board.cells, left, top, board.width / count)
    sheet.add_ruler(left, height - 10)
    settings = board.settings
    sheet.words.append(
        (
            left,
            height - 13.5,
            f"ChArUco {settings.squares_x} x {settings.squares_y}, squares {settings.square_mm:g} mm",
        )
    )
    return sheet


def marker_sheet(layout: MarkerLayout, paper: str = "a4") -> Sheet:
    """All markers of a finger on a sheet, each with its white margin, an outline to cut along and its place.

    layout : the finger's markers; more than fit raise ConfigError
    paper : one of PAPERS
    """
    width, height = _paper(paper)
    sheet = Sheet(width, height)
    card = layout.marker_side_mm + 2 * layout.quiet_zone_mm
    step_x, step_y = max(card + 8, 40.0), card + 14
    a_row = int((width - 2 * MARGIN) // step_x)
    rows = -(-len(layout.markers) // max(a_row, 1))
    if a_row < 1 or MARGIN + rows * step_y + 20 > height:
        raise ConfigError(
            f"{len(layout.markers)} markers of {card:g} mm do not fit on {paper}; use larger paper"
        )
    for index, place in enumerate(layout.markers):
        x = MARGIN + index % a_row * step_x
        y = MARGIN + index // a_row * step_y
        cells = marker_cells(layout.dictionary, place.id)
        edge = layout.quiet_zone_mm
        sheet.add_cells(cells, x + edge, y + edge, layout.marker_side_mm / cells.shape[0])
        sheet.add_outline(x, y, card, card)
        sheet.words.append((x, y + card + 4, f"id {place.id}, z {place.z_mm:g} mm"))
        sheet.words.append((x, y + card + 8, "this edge towards the base"))
    sheet.add_ruler(MARGIN, height - 10)
    return sheet


def _paper(name: str) -> tuple[float, float]:
    if name not in PAPERS:
        raise ConfigError(f"unknown paper {name!r}; known: {', '.join(PAPERS)}")
    return PAPERS[name]


def _pdf_file(objects: list[bytes]) -> bytes:
    """A PDF file of numbered objects with its cross-reference table."""
    body = b"%PDF-1.4\n"
    places = []
    for number, content in enumerate(objects, start=1):
        places.append(len(body))
        body += f"{number} 0 obj\n".encode() + content + b"\nendobj\n"
    table = f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n"
    table += "".join(f"{place:010d} 00000 n \n" for place in places)
    end = f"trailer\n<< /Size {len(objects) + 1} /Root 1 0 R >>\nstartxref\n{len(body)}\n%%EOF\n"
    return body + table.encode() + end.encode()
