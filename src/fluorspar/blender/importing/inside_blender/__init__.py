"""What runs inside Blender, not in Fluorspar: it says what a render of a file would show.

Nothing is interpreted here: meshes are arrays in files, everything else is one JSON file. Blender's Python may lack
NumPy, so arrays are those of `array`.
"""

from .describing import describe

ANSWERS = {"describe": describe}
