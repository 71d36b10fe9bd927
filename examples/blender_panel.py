"""An add-on for Blender: the panel "Fluorescent" in the properties of a material, for `fluorspar import`.

Install it in Preferences > Add-ons > Install from Disk. It writes the custom properties `fluorspar` and
`fluorspar_concentration`, which the file keeps without the add-on too.
"""

from __future__ import annotations

import bpy

bl_info = {
    "name": "Fluorescent materials for Fluorspar",
    "description": "Say which surfaces fluoresce when Fluorspar imports the file",
    "location": "Properties > Material > Fluorescent",
    "version": (1, 0),
    "blender": (3, 4, 0),
    "category": "Material",
}
# Suggestions: the library's fluorescent ones. Any other name that `fluorspar materials list` prints can be typed.
NAMES = [
    "dye-fluorescein", "dye-rhodamine-6g", "dye-stilbene", "neon-orange", "neon-yellow", "orange-on-gray",
    "paper-green", "paper-magenta", "paper-orange", "paper-red", "paper-whitened", "paper-yellow", "poster-green",
    "poster-orange", "poster-red", "poster-yellow", "sticky-note-pink", "sticky-note-yellow",
]  # fmt: skip
NAME, CONCENTRATION = "fluorspar", "fluorspar_concentration"


def set_name(material, name: str) -> None:
    if name:
        material[NAME] = name
    else:
        for key in (NAME, CONCENTRATION):
            if key in material:
                del material[key]


class FluorescentPanel(bpy.types.Panel):
    bl_idname, bl_label = "MATERIAL_PT_fluorspar", "Fluorescent"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "material"

    @classmethod
    def poll(cls, context) -> bool:
        return context.material is not None

    def draw(self, context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(context.material, "fluorescent_name")
        if NAME in context.material:
            self.layout.prop(context.material, "fluorescent_concentration")


def register() -> None:
    bpy.types.Material.fluorescent_name = bpy.props.StringProperty(
        name="Material",
        description="What the surface becomes: a name that `fluorspar materials list` prints; empty: as its nodes say",
        get=lambda material: str(material.get(NAME, "")),
        set=set_name,
        search=lambda material, context, typed: [name for name in NAMES if typed.lower() in name],
    )
    bpy.types.Material.fluorescent_concentration = bpy.props.FloatProperty(
        name="Concentration",
        description="Scales the luminescence; 1: as measured",
        min=0,
        soft_max=2,
        get=lambda material: material.get(CONCENTRATION, 1.0),
        set=lambda material, value: material.__setitem__(CONCENTRATION, value),
    )
    bpy.utils.register_class(FluorescentPanel)


def unregister() -> None:
    bpy.utils.unregister_class(FluorescentPanel)
    del bpy.types.Material.fluorescent_name, bpy.types.Material.fluorescent_concentration
