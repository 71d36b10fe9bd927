"""Files of any kind: their names, tables of text, and writing them whole or not at all."""
