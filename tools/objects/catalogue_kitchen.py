"""Plates, cups with lids, pans, baking dishes, baskets, and what one stirs and cuts with. Metres, kilograms."""

from typing import Any

from tools.objects.kinds import (
    BLACK,
    BLUE,
    BROWN,
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


def _plate(name: str, words: str, mass_kg: float, radii_m: tuple[float, float], height_m: float,
           colors: tuple[str, str]) -> Variant:  # fmt: skip
    """A plate: (radius of the middle, of the rim), (colour, band)."""
    shape = {"radii_m": radii_m, "height_m": height_m, "color": colors[0], "band": colors[1]}
    return Variant(name, words, mass_kg, shape)


def _teacup(name: str, words: str, mass_kg: float, radii_m: tuple[float, float], height_m: float,
            colors: tuple[str, str, str]) -> Variant:  # fmt: skip
    """A cup: (radius of the foot, of the rim), (outside, inside, band and handle)."""
    color, inside, band = colors
    shape = {"radii_m": radii_m, "height_m": height_m, "color": color, "inside": inside, "band": band}
    return Variant(name, words, mass_kg, shape)


def _lidded(name: str, words: str, mass_kg: float, size_m: tuple[float, float, float],
            lid: tuple[float, float, str], color: str, design: Look,
            label: tuple[float, float] = (0.0, 1.0)) -> Variant:  # fmt: skip
    """A pot or a cup with a lid: (radius of the foot, under the lid, height)."""
    shape = {"radii_m": size_m[:2], "height_m": size_m[2], "lid": lid, "color": color}
    return Variant(name, words, mass_kg, {**shape, "design": design, "label": label})


def _pan(name: str, words: str, mass_kg: float, size_m: tuple[float, float, float],
         handle_m: tuple[float, float, float], colors: tuple[str, str, str]) -> Variant:  # fmt: skip
    """A pan: (radius of the base, of the rim, height), (outside, inside, grip)."""
    outside, inside, grip = colors
    shape = {"radii_m": size_m[:2], "height_m": size_m[2], "handle_m": handle_m}
    return Variant(name, words, mass_kg, {**shape, "outside": outside, "inside": inside, "grip": grip})


def _dish(name: str, words: str, mass_kg: float, base_m: tuple[float, float], rim_m: tuple[float, float],
          height_m: float, colors: tuple[str, str], **options: Any) -> Variant:  # fmt: skip
    """An open dish: (depth, width) at the base and at the rim; (outside, inside)."""
    shape = {"base_m": base_m, "rim_m": rim_m, "height_m": height_m, "color": colors[0], "inside": colors[1]}
    return Variant(name, words, mass_kg, {**shape, **options})


_INOX, _COAT = "#c9ccd1", "#2b2d31"
_WICKER = {"wall_m": 0.006, "woven": True}
_STONEWARE = {"wall_m": 0.006, "lugs": True}

KINDS = (
    Kind("plate", "vessels:plate", (
        _plate("plate_white", "the white plate with a blue rim", 0.29, (0.058, 0.095), 0.019, (WHITE, BLUE)),
        _plate("plate_green", "the small green plate", 0.20, (0.048, 0.080), 0.017, ("#9ccf8a", GREEN)),
        _plate("plate_soup", "the deep cream soup plate", 0.31, (0.050, 0.090), 0.040, (CREAM, BROWN)),
        _plate("plate_picnic", "the red picnic plate", 0.075, (0.068, 0.080), 0.026, (RED, WHITE)),
    )),
    Kind("teacup", "vessels:teacup", (
        _teacup("teacup_blue", "the blue teacup", 0.14, (0.022, 0.042), 0.058, (BLUE, WHITE, SKY)),
        _teacup("teacup_rose", "the pink teacup", 0.13, (0.020, 0.040), 0.060, (PINK, WHITE, "#b03a6a")),
        _teacup("teacup_espresso", "the small brown espresso cup", 0.09, (0.017, 0.032), 0.050,
                (BROWN, CREAM, CREAM)),
    ), held_out=True),
    Kind("takeaway_cup", "cans:lidded_cup", (
        _lidded("takeaway_cup_brown", "the brown takeaway coffee cup", 0.26, (0.028, 0.039, 0.110),
                (0.0025, 0.015, BLACK), WHITE, look(BROWN, "COFFEE", CREAM, BROWN), (0.22, 0.80)),
        _lidded("takeaway_cup_green", "the green takeaway tea cup", 0.33, (0.029, 0.041, 0.128),
                (0.0025, 0.015, WHITE), CREAM, look(GREEN, "TEA\nTO GO", WHITE, GREEN),
                (0.2, 0.82)),
        _lidded("takeaway_cup_red", "the red takeaway cola cup", 0.31, (0.027, 0.040, 0.122),
                (0.0025, 0.013, WHITE), RED, look(RED, "COLA", WHITE, RED, "star", WHITE), (0.12, 0.90)),
    ), rolls=True),
    Kind("yogurt_pot", "cans:lidded_cup", (
        _lidded("yogurt_pot_strawberry", "the strawberry yogurt pot", 0.16, (0.026, 0.034, 0.072),
                (0.002, 0.0015, "#d9dbe0"), WHITE, look(PINK, "STRAWBERRY\nYOGURT", WHITE, "#c0281f")),
        _lidded("yogurt_pot_blueberry", "the blueberry yogurt pot", 0.16, (0.026, 0.034, 0.072),
                (0.002, 0.0015, "#7f8fd0"), WHITE, look(PURPLE, "BLUEBERRY\nYOGURT", WHITE, BLUE)),
        _lidded("yogurt_pot_vanilla", "the large vanilla yogurt pot", 0.26, (0.033, 0.042, 0.084),
                (0.002, 0.0015, YELLOW), CREAM, look(CREAM, "VANILLA\nYOGURT", YELLOW, BROWN)),
    ), rolls=True),
    Kind("saucepan", "vessels:pan", (
        _pan("saucepan_steel", "the steel saucepan", 0.52, (0.070, 0.070, 0.072), (0.125, 0.0095, 0.012),
             (_INOX, "#a9adb3", BLACK)),
        _pan("saucepan_red", "the red enamel saucepan", 0.48, (0.062, 0.062, 0.066), (0.120, 0.0095, 0.010),
             (RED, CREAM, BROWN)),
        _pan("saucepan_blue", "the small blue milk pan", 0.31, (0.050, 0.050, 0.062), (0.110, 0.0085, 0.010),
             (BLUE, WHITE, BLACK)),
    )),
    Kind("frying_pan", "vessels:pan", (
        _pan("frying_pan_black", "the black frying pan", 0.33, (0.056, 0.070, 0.032), (0.130, 0.0095, 0.030),
             (BLACK, _COAT, "#3a3a3a")),
        _pan("frying_pan_copper", "the copper frying pan", 0.31, (0.052, 0.066, 0.034), (0.125, 0.0095, 0.028),
             ("#b8683a", _INOX, BROWN)),
        _pan("frying_pan_green", "the small green frying pan", 0.23, (0.046, 0.058, 0.028), (0.115, 0.0090, 0.024),
             (GREEN, _COAT, "#c99a5b")),
    )),
    Kind("baking_dish", "dishes:open_dish", (
        _dish("baking_dish_blue", "the blue baking dish", 0.62, (0.105, 0.155), (0.125, 0.180), 0.050,
              (BLUE, WHITE), **_STONEWARE),
        _dish("baking_dish_red", "the small red baking dish", 0.40, (0.080, 0.115), (0.095, 0.135), 0.042,
              (RED, CREAM), **_STONEWARE),
        _dish("baking_dish_white", "the white baking dish", 0.52, (0.100, 0.100), (0.120, 0.120), 0.055,
              (WHITE, WHITE), **_STONEWARE),
    )),
    Kind("basket", "dishes:open_dish", (
        _dish("basket_brown", "the brown wicker basket", 0.16, (0.105, 0.150), (0.130, 0.180), 0.075,
              ("#b98a4e", "#6e4a22"), **_WICKER),
        _dish("basket_white", "the small white wicker basket", 0.11, (0.085, 0.110), (0.105, 0.135), 0.062,
              ("#f0ebe0", "#b9b09c"), **_WICKER),
        _dish("basket_grey", "the square grey wicker basket", 0.13, (0.100, 0.100), (0.122, 0.122), 0.085,
              (GRAY, "#4c5157"), **_WICKER),
    )),
    Kind("spoon", "utensils:spoon", (
        Variant("spoon_steel", "the steel serving spoon", 0.070, {
            "length_m": 0.215, "bowl_m": (0.024, 0.035, 0.011), "handle_m": (0.016, 0.0045), "arch_m": 0.012,
            "color": "steel"}),
        Variant("spoon_wooden", "the wooden cooking spoon", 0.026, {
            "length_m": 0.250, "bowl_m": (0.026, 0.035, 0.012), "handle_m": (0.014, 0.011), "arch_m": 0.002,
            "color": "#c99a5b"}),
        Variant("spoon_orange", "the orange plastic spoon", 0.024, {
            "length_m": 0.235, "bowl_m": (0.028, 0.040, 0.014), "handle_m": (0.018, 0.007), "arch_m": 0.010,
            "color": ORANGE}),
    )),
    Kind("spatula", "utensils:turner", (
        Variant("spatula_black", "the black spatula", 0.052, {
            "blade_m": (0.090, 0.075), "handle_m": (0.170, 0.0085), "arch_m": 0.022, "color": "#2b2d31",
            "grip": BLACK}),
        Variant("spatula_steel", "the steel spatula with a red grip", 0.095, {
            "blade_m": (0.085, 0.070), "handle_m": (0.180, 0.0090), "arch_m": 0.022, "color": "steel",
            "grip": RED}),
        Variant("spatula_teal", "the small teal spatula", 0.036, {
            "blade_m": (0.075, 0.062), "handle_m": (0.140, 0.0080), "arch_m": 0.020, "color": TEAL,
            "grip": TEAL}),
    ), held_out=True),
    Kind("scissors", "utensils:scissors", (
        Variant("scissors_orange", "the orange scissors", 0.052, {"length_m": 0.185, "grip": ORANGE}),
        Variant("scissors_black", "the large black scissors", 0.070, {"length_m": 0.205, "grip": BLACK}),
        Variant("scissors_blue", "the small blue scissors", 0.026, {"length_m": 0.140, "grip": BLUE}),
    )),
)  # fmt: skip
