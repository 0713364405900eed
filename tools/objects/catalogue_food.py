"""Cans, jars, bottles with food and drink in them, and fruit. Metres, kilograms."""

from typing import Any

from tools.objects.kinds import (
    BLACK,
    BLUE,
    BROWN,
    CREAM,
    GRAY,
    GREEN,
    ORANGE,
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


def _can(name: str, words: str, mass_kg: float, radius_m: float, height_m: float, design: Look) -> Variant:
    """A tin or a drink can."""
    return Variant(name, words, mass_kg, {"radius_m": radius_m, "height_m": height_m, "design": design})


def _jar(
    name: str, words: str, mass_kg: float, size_m: tuple[float, float], colors: tuple[str, str], design: Look
) -> Variant:
    """A jar: (radius, height), (content, lid)."""
    content, lid = colors
    shape = {"radius_m": size_m[0], "height_m": size_m[1]}
    return Variant(name, words, mass_kg, {**shape, "content": content, "lid": lid, "design": design})


def _bottle(
    name: str, words: str, mass_kg: float, size_m: tuple[float, float, float], cap: tuple[float, float, str],
    color: str, design: Look, label: tuple[float, float] = (0.2, 0.8),
) -> Variant:  # fmt: skip
    """A round bottle: (radius, height, height of the shoulder)."""
    shape = {"radius_m": size_m[0], "height_m": size_m[1], "shoulder_m": size_m[2]}
    return Variant(
        name, words, mass_kg, {**shape, "cap": cap, "color": color, "design": design, "label": label}
    )


def _sauce(name: str, words: str, mass_kg: float, size_m: tuple[float, float, float], color: str, cap: str,
           design: Look) -> Variant:  # fmt: skip
    """A squeeze bottle with a pointed cap."""
    shape = {"size_m": size_m, "waist": 0.88, "shoulder_m": 0.016, "cap": (0.016, 0.007, 0.028, cap)}
    return Variant(name, words, mass_kg, {**shape, "color": color, "design": design})


KINDS = (
    Kind("soup_can", "cans:food_can", (
        _can("soup_can_red", "the red tomato soup can", 0.349, 0.033, 0.101,
             look(RED, "TOMATO\nSOUP", WHITE, RED, "fruit", "#e8452c")),
        _can("soup_can_yellow", "the yellow corn can", 0.33, 0.0365, 0.082,
             look(YELLOW, "SWEET\nCORN", GREEN, WHITE, "sun", WHITE)),
        _can("soup_can_green", "the green pea can", 0.31, 0.0365, 0.074,
             look(GREEN, "PEAS", CREAM, GREEN, "disc", "#9ad04f")),
    ), rolls=True),
    Kind("tuna_can", "cans:food_can", (
        _can("tuna_can_blue", "the blue tuna can", 0.171, 0.0425, 0.034,
             look(BLUE, "TUNA", WHITE, BLUE, "fish", SKY)),
        _can("tuna_can_orange", "the orange salmon can", 0.15, 0.037, 0.038,
             look(ORANGE, "SALMON", CREAM, RED, "fish", RED)),
        _can("tuna_can_green", "the small green sardine can", 0.12, 0.035, 0.032,
             look(GREEN, "SARDINES", WHITE, GREEN, "fish", SKY)),
    ), rolls=True),
    Kind("soda_can", "cans:drink_can", (
        _can("soda_can_green", "the green lime soda can", 0.355, 0.033, 0.122,
             look(GREEN, "LIME\nSODA", WHITE, GREEN, "leaf", "#bfe86a")),
        _can("soda_can_purple", "the purple grape soda can", 0.355, 0.033, 0.122,
             look(PURPLE, "GRAPE\nSODA", YELLOW, PURPLE, "disc", "#c69ae8")),
        _can("soda_can_empty", "the empty orange soda can", 0.016, 0.033, 0.122,
             look(ORANGE, "ORANGE\nSODA", BLACK, ORANGE, "sun", YELLOW)),
    ), rolls=True),
    Kind("jam_jar", "cans:jar", (
        _jar("jam_jar_strawberry", "the strawberry jam jar", 0.38, (0.034, 0.096), ("#8c1521", WHITE),
             look(CREAM, "STRAWBERRY\nJAM", CREAM, RED, "fruit", RED)),
        _jar("jam_jar_honey", "the honey jar", 0.45, (0.035, 0.100), ("#d08a1c", "#c9a03a"),
             look(YELLOW, "HONEY", BLACK, YELLOW, "sun", BROWN)),
        _jar("jam_jar_pickles", "the pickle jar", 0.56, (0.037, 0.120), ("#6f8f2a", GREEN),
             look(WHITE, "PICKLES", GREEN, WHITE, "leaf", "#bfe86a")),
    ), rolls=True),
    Kind("spice_jar", "cans:jar", (
        _jar("spice_jar_paprika", "the paprika jar", 0.11, (0.0225, 0.098), ("#a8321a", BLACK),
             look(WHITE, "PAPRIKA", RED, WHITE, "flame", RED)),
        _jar("spice_jar_pepper", "the pepper jar", 0.12, (0.0225, 0.098), ("#3a332c", GRAY),
             look(CREAM, "PEPPER", BLACK, CREAM, "disc", GRAY)),
        _jar("spice_jar_curry", "the wide curry jar", 0.13, (0.026, 0.088), ("#d99a1c", RED),
             look(YELLOW, "CURRY", RED, YELLOW, "sun", RED)),
    ), rolls=True),
    Kind("water_bottle", "bottles:round_bottle", (
        _bottle("water_bottle_blue", "the blue water bottle", 0.52, (0.032, 0.205, 0.045),
            (0.014, 0.018, BLUE),
                "#a9d6f0", look(BLUE, "SPRING\nWATER", WHITE, BLUE, "drop", SKY), (0.35, 0.8)),
        _bottle("water_bottle_green", "the green mineral water bottle", 0.53, (0.031, 0.210, 0.050),
                (0.014, 0.018, GREEN), "#9fd8b4", look(GREEN, "MINERAL\nWATER", WHITE, GREEN, "drop", WHITE),
                    (0.3, 0.75)),
        _bottle("water_bottle_empty", "the empty sports bottle", 0.085, (0.036, 0.190, 0.020),
            (0.022, 0.030, BLACK),
                TEAL, look(TEAL, "SPORT", BLACK, WHITE, "star", YELLOW), (0.25, 0.75)),
    ), rolls=True),
    Kind("ketchup_bottle", "bottles:oval_bottle", (
        _sauce("ketchup_bottle", "the ketchup bottle", 0.34, (0.0434, 0.0645, 0.1486), "#b01a14", WHITE,
               look("#b01a14", "KETCHUP", WHITE, RED, "fruit", "#e8452c")),
        _sauce("mustard_bottle", "the mustard bottle", 0.33, (0.0486, 0.0651, 0.1600), "#e8b923", "#b01a14",
               look("#e8b923", "MUSTARD", RED, WHITE, "sun", RED)),
        _sauce("mayo_bottle", "the mayo bottle", 0.31, (0.0410, 0.0645, 0.1479), "#f3eeda", BLUE,
               look("#f3eeda", "MAYO", BLUE, WHITE, "disc", YELLOW)),
    )),
    Kind("apple", "fruit:round_fruit", (
        Variant("apple_red", "the red apple", 0.17, {
            "radii_m": (0.037, 0.034), "color": "#b3201c", "spots": "#d9722f", "dimple_m": 0.007}),
        Variant("apple_green", "the green apple", 0.15, {
            "radii_m": (0.035, 0.033), "color": "#7fb135", "spots": "#b9d76a", "dimple_m": 0.007}),
        Variant("apple_yellow", "the small yellow apple", 0.13, {
            "radii_m": (0.032, 0.030), "color": "#e3c13a", "spots": "#c9742a", "dimple_m": 0.006}),
    ), rolls=True),
    Kind("orange", "fruit:round_fruit", (
        Variant("orange_fruit", "the orange", 0.18, {
            "radii_m": (0.0365, 0.0355), "color": "#ee8a1d", "spots": "#d97510", "dimple_m": 0.001,
                "leaf": True}),
        Variant("mandarin", "the small mandarin", 0.09, {
            "radii_m": (0.029, 0.024), "color": "#f07818", "spots": "#d8620c", "dimple_m": 0.002,
                "leaf": True}),
        Variant("grapefruit", "the pink grapefruit", 0.21, {
            "radii_m": (0.0405, 0.0385), "color": "#f0996a", "spots": "#e0764e", "dimple_m": 0.001,
                "leaf": True}),
    ), rolls=True),
    Kind("pear", "fruit:pear", (
        Variant("pear_green", "the green pear", 0.17, {
            "radius_m": 0.033, "height_m": 0.088, "colors": ("#8a9a3a", "#b9c24e", "#c9cf5f", "#a9b548")}),
        Variant("pear_brown", "the brown pear", 0.19, {
            "radius_m": 0.035, "height_m": 0.095, "colors": ("#7a5a2a", "#a07a3c", "#b08a48", "#8c6a34")}),
        Variant("pear_red", "the small red pear", 0.14, {
            "radius_m": 0.031, "height_m": 0.082, "colors": ("#8a2f22", "#b4402c", "#c96a3a", "#a03a28")}),
    ), rolls=True, held_out=True),
    Kind("lemon", "fruit:lemon", (
        Variant("lemon_yellow", "the lemon", 0.10, {
            "radius_m": 0.027, "length_m": 0.078, "color": "#f4d52c", "spots": "#dcb91c"}),
        Variant("lime_green", "the lime", 0.07, {
            "radius_m": 0.024, "length_m": 0.064, "color": "#5f9e2f", "spots": "#4b8423"}),
        Variant("citron_pale", "the large pale citron", 0.14, {
            "radius_m": 0.031, "length_m": 0.090, "color": "#f7e58a", "spots": "#e3cc58"}),
    ), rolls=True),
    Kind("banana", "fruit:banana", (
        Variant("banana_yellow", "the yellow banana", 0.13, {
            "length_m": 0.165, "radius_m": 0.018, "colors": ("#f2cf3a", "#7a5a22")}),
        Variant("banana_green", "the green banana", 0.12, {
            "length_m": 0.150, "radius_m": 0.0175, "colors": ("#a9bf3f", "#5f6f22")}),
        Variant("banana_red", "the small red banana", 0.10, {
            "length_m": 0.128, "radius_m": 0.019, "colors": ("#a8483a", "#5f3a22")}),
    )),
)  # fmt: skip
