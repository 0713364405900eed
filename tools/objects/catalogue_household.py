"""Dishes, the bathroom and the kitchen sink. Metres, kilograms."""

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


def _mug(
    name: str, words: str, mass_kg: float, size_m: tuple[float, float], colors: tuple[str, str], design: Look
) -> Variant:
    """A mug: (radius, height), (outside, inside)."""
    shape = {"radius_m": size_m[0], "height_m": size_m[1], "color": colors[0], "inside": colors[1]}
    return Variant(name, words, mass_kg, {**shape, "design": design})


def _cup(
    name: str,
    words: str,
    mass_kg: float,
    radii_m: tuple[float, float],
    height_m: float,
    color: str,
    design: Look,
) -> Variant:
    """A cup or a pot that widens upwards: radius at the foot and at the rim."""
    return Variant(
        name, words, mass_kg, {"radii_m": radii_m, "height_m": height_m, "color": color, "design": design}
    )


def _bowl(
    name: str,
    words: str,
    mass_kg: float,
    radii_m: tuple[float, float],
    height_m: float,
    outside: str,
    inside: str,
) -> Variant:
    return Variant(
        name, words, mass_kg, {"radii_m": radii_m, "height_m": height_m, "color": outside, "inside": inside}
    )


def _plain(color: str, motif: str = "none", motif_color: str = WHITE, trim: str | None = None) -> Look:
    """A print without words."""
    return look(color, "", color, WHITE, motif, motif_color, trim)


KINDS = (
    Kind("mug", "vessels:mug", (
        _mug("mug_red", "the red mug with a star", 0.32, (0.040, 0.095), (RED, WHITE),
            _plain(RED, "star", YELLOW)),
        _mug("mug_white", "the white tea mug", 0.30, (0.041, 0.090), (WHITE, WHITE),
            look(WHITE, "TEA", WHITE, BLUE, "leaf", GREEN)),
        _mug("mug_black", "the black coffee mug", 0.34, (0.040, 0.100), (BLACK, ORANGE),
            look(BLACK, "COFFEE", BLACK, ORANGE)),
    )),
    Kind("bowl", "vessels:bowl", (
        _bowl("bowl_blue", "the blue bowl", 0.24, (0.038, 0.072), 0.055, BLUE, WHITE),
        _bowl("bowl_yellow", "the small yellow bowl", 0.13, (0.032, 0.058), 0.045, YELLOW, CREAM),
        _bowl("bowl_green", "the deep green bowl", 0.26, (0.034, 0.062), 0.070, GREEN, "#dcefd6"),
    )),
    Kind("tumbler", "vessels:tumbler", (
        _cup("tumbler_green", "the green plastic cup", 0.045, (0.028, 0.038), 0.105, "#8fd19e",
            _plain(GREEN, "disc", "#8fd19e")),
        _cup("tumbler_pink", "the pink plastic cup", 0.040, (0.027, 0.036), 0.090, "#f4b6cd",
            _plain(PINK, "star", WHITE)),
        _cup("tumbler_blue", "the large blue plastic cup", 0.055, (0.029, 0.040), 0.120, SKY,
            _plain(BLUE, "drop", SKY)),
    ), held_out=True),
    Kind("flower_pot", "vessels:tumbler", (
        _cup("flower_pot_clay", "the clay flower pot", 0.12, (0.030, 0.042), 0.075, "#b5623c",
            _plain("#b5623c", trim="#9a4f2e")),
        _cup("flower_pot_teal", "the teal flower pot", 0.13, (0.033, 0.045), 0.080, "#cfe6e6",
            _plain(TEAL, "leaf", WHITE)),
        _cup("flower_pot_purple", "the small purple flower pot", 0.08, (0.025, 0.035), 0.062, "#cdb8e4",
            _plain(PURPLE, "sun", YELLOW)),
    )),
    Kind("shampoo_bottle", "bottles:oval_bottle", (
        Variant("shampoo_bottle_purple", "the purple shampoo bottle", 0.31, {
            "size_m": (0.046, 0.070, 0.185), "waist": 0.93, "shoulder_m": 0.014,
                "cap": (0.0165, 0.0165, 0.025, WHITE),
            "color": PURPLE, "design": look(PURPLE, "SHAMPOO", WHITE, PURPLE, "drop", "#d9c4f2")}),
        Variant("shampoo_bottle_teal", "the teal shower gel bottle", 0.28, {
            "size_m": (0.042, 0.066, 0.170), "waist": 0.95, "shoulder_m": 0.012,
                "cap": (0.0165, 0.0165, 0.022, GRAY),
            "color": TEAL, "design": look(TEAL, "SHOWER\nGEL", CREAM, TEAL, "leaf", CREAM)}),
        Variant("shampoo_bottle_pink", "the small pink lotion bottle", 0.20, {
            "size_m": (0.040, 0.058, 0.145), "waist": 0.94, "shoulder_m": 0.012,
                "cap": (0.0150, 0.0150, 0.020, WHITE),
            "color": PINK, "design": look(PINK, "LOTION", WHITE, "#b03a6a", "drop", WHITE)}),
    ), held_out=True),
    Kind("vitamin_bottle", "bottles:round_bottle", (
        Variant("vitamin_bottle_white", "the white vitamin bottle", 0.11, {
            "radius_m": 0.0285, "height_m": 0.098, "shoulder_m": 0.010, "cap": (0.022, 0.020, GREEN),
                "color": WHITE,
            "design": look(WHITE, "VITAMIN\nC", ORANGE, WHITE, "fruit", YELLOW), "label": (0.08, 0.95)}),
        Variant("vitamin_bottle_amber", "the amber pill bottle", 0.07, {
            "radius_m": 0.022, "height_m": 0.085, "shoulder_m": 0.006, "cap": (0.0205, 0.018, WHITE),
                "color": "#c96a14",
            "design": look(WHITE, "PILLS", WHITE, RED), "label": (0.1, 0.85)}),
        Variant("vitamin_bottle_brown", "the brown cough syrup bottle", 0.21, {
            "radius_m": 0.028, "height_m": 0.125, "shoulder_m": 0.020, "cap": (0.0145, 0.018, WHITE),
                "color": "#6b3a14",
            "design": look(WHITE, "COUGH\nSYRUP", TEAL, WHITE), "label": (0.08, 0.9)}),
    ), rolls=True),
    Kind("spray_can", "cans:spray_can", (
        Variant("spray_can_blue", "the blue spray can", 0.36, {
            "radius_m": 0.0265, "height_m": 0.200, "cap": WHITE,
                "design": look(BLUE, "FRESH\nAIR", WHITE, BLUE, "leaf", SKY)}),
        Variant("spray_can_red", "the red spray paint can", 0.40, {
            "radius_m": 0.0325, "height_m": 0.190, "cap": RED,
                "design": look(BLACK, "SPRAY\nPAINT", RED, WHITE, "drop", RED)}),
        Variant("spray_can_pink", "the small pink hair spray can", 0.21, {
            "radius_m": 0.024, "height_m": 0.150, "cap": PINK,
                "design": look(PINK, "HAIR\nSPRAY", WHITE, "#b03a6a", "star", WHITE)}),
    ), rolls=True),
    Kind("toothpaste_tube", "bottles:toothpaste_tube", (
        Variant("toothpaste_tube_white", "the white toothpaste tube", 0.12, {
            "length_m": 0.165, "radius_m": 0.019, "tail_m": 0.058, "cap": BLUE,
            "design": look(WHITE, "TOOTHPASTE", SKY, BLUE, "drop", BLUE, BLUE)}),
        Variant("toothpaste_tube_red", "the red hand cream tube", 0.08, {
            "length_m": 0.130, "radius_m": 0.017, "tail_m": 0.048, "cap": WHITE,
            "design": look(RED, "HAND CREAM", CREAM, RED, "leaf", GREEN)}),
        Variant("toothpaste_tube_green", "the green sun cream tube", 0.14, {
            "length_m": 0.150, "radius_m": 0.021, "tail_m": 0.060, "cap": ORANGE,
            "design": look(GREEN, "SUN CREAM", YELLOW, GREEN, "sun", ORANGE)}),
    )),
    Kind("sponge", "boxes:sponge", (
        Variant("sponge_yellow", "the yellow sponge", 0.016,
            {"size_m": (0.070, 0.110, 0.032), "foam": "#f2d04b", "scourer": "#2f7d4a"}),
        Variant("sponge_blue", "the blue sponge", 0.014,
            {"size_m": (0.065, 0.095, 0.030), "foam": "#5fa8dc", "scourer": "#2a3f8f"}),
        Variant("sponge_pink", "the small pink sponge", 0.011,
            {"size_m": (0.060, 0.085, 0.036), "foam": "#f2a7bf", "scourer": "#8f3f6a"}),
    )),
)  # fmt: skip
