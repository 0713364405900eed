"""Playthings and small things of the house. Metres, kilograms."""

from typing import Any

from tools.objects.kinds import (
    BLACK,
    BLUE,
    CREAM,
    GRAY,
    GREEN,
    ORANGE,
    PINK,
    PURPLE,
    RED,
    SKY,
    TEAL,
    WHITE,
    YELLOW,
    Kind,
    Variant,
    look,
)  # fmt: skip

Look = dict[str, Any]


def _cards(
    name: str, words: str, mass_kg: float, size_m: tuple[float, float, float], design: Look
) -> Variant:
    """A box of cards that lies flat: (depth, width, height)."""
    return Variant(name, words, mass_kg, {"size_m": size_m, "design": design, "faces": {"top": design}})


def _notebook(name: str, words: str, mass_kg: float, size_m: tuple[float, float, float], wire: str,
              design: Look) -> Variant:  # fmt: skip
    return Variant(name, words, mass_kg, {"size_m": size_m, "wire": wire, "design": design})


def _bulb(name: str, words: str, mass_kg: float, size_m: tuple[float, float], cap_m: tuple[float, float],
          glass: str, neck: str) -> Variant:  # fmt: skip
    """A light bulb: (radius, length) and those of its cap."""
    shape = {"radius_m": size_m[0], "length_m": size_m[1], "cap_m": cap_m}
    return Variant(name, words, mass_kg, {**shape, "glass": glass, "neck": neck})


def _block(name: str, words: str, mass_kg: float, shape: str, size_m: tuple[float, float, float],
           color: str) -> Variant:  # fmt: skip
    return Variant(name, words, mass_kg, {"shape": shape, "size_m": size_m, "color": color})


def _phone(name: str, words: str, mass_kg: float, size_m: tuple[float, float, float], color: str,
           screen: tuple[str, str], clock: str) -> Variant:  # fmt: skip
    return Variant(name, words, mass_kg, {"size_m": size_m, "color": color, "screen": screen, "clock": clock})


_DECK = (0.091, 0.066, 0.019)
_E27, _E14 = (0.0132, 0.026), (0.0072, 0.024)

KINDS = (
    Kind("playing_cards", "boxes:carton", (
        _cards("playing_cards_red", "the red box of playing cards", 0.095, _DECK,
               look(RED, "PLAYING\nCARDS", WHITE, RED, "heart", WHITE, CREAM)),
        _cards("playing_cards_blue", "the blue box of poker cards", 0.095, _DECK,
               look(BLUE, "POKER", WHITE, BLUE, "spade", WHITE, CREAM)),
        _cards("playing_cards_yellow", "the yellow box of memory cards", 0.115, (0.098, 0.070, 0.028),
               look(YELLOW, "MEMORY", PURPLE, WHITE, "diamond", PURPLE, PURPLE)),
    )),
    Kind("notebook", "boxes:notebook", (
        _notebook("notebook_green", "the green spiral notebook", 0.150, (0.148, 0.105, 0.015), GRAY,
                  look(GREEN, "NOTES", WHITE, GREEN, "leaf", WHITE)),
        _notebook("notebook_black", "the black spiral sketch pad", 0.190, (0.165, 0.110, 0.018), "#c9ccd1",
                  look(BLACK, "SKETCH\nPAD", YELLOW, BLACK, "square", RED)),
        _notebook("notebook_purple", "the small purple spiral notebook", 0.085, (0.105, 0.074, 0.016), YELLOW,
                  look(PURPLE, "TO DO", WHITE, PURPLE, "star", YELLOW)),
    )),
    Kind("light_bulb", "lamps:light_bulb", (
        _bulb("light_bulb_white", "the white light bulb", 0.045, (0.030, 0.108), _E27, "#fbfaf4", "#e4e4e0"),
        _bulb("light_bulb_amber", "the amber light bulb", 0.034, (0.030, 0.105), _E27, "#e2a43c", "#c98a28"),
        _bulb("light_bulb_small", "the small cream light bulb", 0.024, (0.0225, 0.080), _E14, "#fdf3cf", "#dedccf"),
    ), rolls=True),
    Kind("phone", "boxes:phone", (
        _phone("phone_black", "the phone with a blue screen", 0.17, (0.147, 0.071, 0.0085), "#1c1e22",
               ("#1f3f9a", "#58a6e8"), "10:24"),
        _phone("phone_pink", "the pink phone with an orange screen", 0.18, (0.155, 0.074, 0.0095), "#f0a9bd",
               ("#f28c28", "#f7d070"), "07:45"),
        _phone("phone_teal", "the small teal phone", 0.14, (0.131, 0.064, 0.0100), TEAL,
               ("#0f5d57", "#7fd8b5"), "18:30"),
    )),
    Kind("toy_animal", "figures:animal", (
        Variant("toy_elephant", "the grey toy elephant", 0.085, {
            "body_m": (0.027, 0.082), "legs_m": (0.026, 0.0105), "neck_m": (0.018, 0.010, 0.010),
            "head_m": (0.020, 0.018), "ears_m": (0.016, 0.002), "snout_m": (0.0060, 0.0), "color": "#8f98a3",
            "accent": "#6f7883", "trunk": True}),
        Variant("toy_pig", "the pink toy pig", 0.060, {
            "body_m": (0.023, 0.070), "legs_m": (0.016, 0.0075), "neck_m": (0.016, 0.006, 0.010),
            "head_m": (0.019, 0.018), "ears_m": (0.0065, 0.014), "snout_m": (0.0080, 0.006),
            "color": "#f0a3b4", "accent": "#d97790"}),
        Variant("toy_cow", "the black and white toy cow", 0.080, {
            "body_m": (0.022, 0.086), "legs_m": (0.030, 0.0070), "neck_m": (0.014, 0.018, 0.016),
            "head_m": (0.020, 0.0135), "ears_m": (0.0055, 0.009), "snout_m": (0.0095, 0.004), "color": WHITE,
            "accent": "#24211f", "spots": 9}),
        Variant("toy_giraffe", "the yellow toy giraffe", 0.070, {
            "body_m": (0.018, 0.068), "legs_m": (0.042, 0.0060), "neck_m": (0.0085, 0.060, 0.020),
            "head_m": (0.018, 0.0105), "ears_m": (0.0045, 0.010), "snout_m": (0.0070, 0.004),
            "color": "#efbf45", "accent": "#8a5520", "spots": 30}),
    )),
    Kind("rubber_duck", "figures:rubber_duck", (
        Variant("rubber_duck_yellow", "the yellow rubber duck", 0.045,
            {"length_m": 0.095, "color": "#f7d024", "beak": ORANGE}),
        Variant("rubber_duck_pink", "the pink rubber duck", 0.038,
            {"length_m": 0.085, "color": PINK, "beak": RED}),
        Variant("rubber_duck_small", "the small blue rubber duck", 0.024,
            {"length_m": 0.068, "color": SKY, "beak": YELLOW}),
    )),
    Kind("toy_plane", "toys:toy_plane", (
        Variant("toy_plane_red", "the red toy plane", 0.060, {"length_m": 0.140, "color": RED, "wing": WHITE}),
        Variant("toy_plane_blue", "the blue toy plane", 0.075,
            {"length_m": 0.155, "color": BLUE, "wing": YELLOW}),
        Variant("toy_plane_green", "the small green toy plane", 0.042,
            {"length_m": 0.115, "color": GREEN, "wing": CREAM}),
    ), held_out=True),
    Kind("wooden_block", "toys:wooden_block", (
        _block("wooden_block_arch", "the red wooden arch", 0.075, "arch", (0.035, 0.090, 0.045), RED),
        _block("wooden_block_roof", "the blue wooden roof block", 0.045, "roof", (0.038, 0.076, 0.038), BLUE),
        _block("wooden_block_cylinder", "the yellow wooden cylinder", 0.062, "cylinder", (0.040, 0.040, 0.075), YELLOW),
        _block("wooden_block_long", "the long green wooden block", 0.085, "cuboid", (0.036, 0.120, 0.030), GREEN),
    )),
)  # fmt: skip
