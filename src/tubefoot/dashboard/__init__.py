"""The live bench in the browser: one thread owns the bench, a server shows it and passes orders on."""
