"""The mesh of the scene `cornell-mesh`: read from any file, and made fit to be rendered."""
