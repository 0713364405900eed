"""Tools, toys, and things of the desk. Metres, kilograms."""

from tools.objects.kinds import (
    BLACK,
    BLUE,
    CREAM,
    GRAY,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    WHITE,
    YELLOW,
    Kind,
    Variant,
)  # fmt: skip

KINDS = (
    Kind("screwdriver", "tools:screwdriver", (
        Variant("screwdriver_yellow", "the yellow screwdriver", 0.11, {
            "handle_m": (0.098, 0.016), "shaft_m": (0.100, 0.0032), "color": YELLOW, "accent": BLACK}),
        Variant("screwdriver_red", "the short red screwdriver", 0.09, {
            "handle_m": (0.085, 0.017), "shaft_m": (0.045, 0.0035), "color": RED, "accent": GRAY}),
        Variant("screwdriver_blue", "the long blue screwdriver", 0.13, {
            "handle_m": (0.105, 0.017), "shaft_m": (0.125, 0.0036), "color": BLUE, "accent": YELLOW}),
    )),
    Kind("hammer", "tools:hammer", (
        Variant("hammer_blue", "the hammer with the blue grip", 0.42,
            {"length_m": 0.235, "handle": "#c99a5b", "grip": BLUE}),
        Variant("hammer_black", "the small hammer with the black grip", 0.33,
            {"length_m": 0.190, "handle": ORANGE, "grip": BLACK}),
        Variant("hammer_red", "the hammer with the red grip", 0.38,
            {"length_m": 0.215, "handle": "#8a8f96", "grip": RED}),
    ), held_out=True),
    Kind("clamp", "tools:clamp", (
        Variant("clamp_orange", "the orange clamp", 0.16, {"size_m": (0.075, 0.100), "color": ORANGE}),
        Variant("clamp_green", "the small green clamp", 0.12, {"size_m": (0.060, 0.075), "color": GREEN}),
        Variant("clamp_blue", "the wide blue clamp", 0.18, {"size_m": (0.070, 0.125), "color": BLUE}),
    )),
    Kind("toy_brick", "toys:toy_brick", (
        Variant("toy_brick_red", "the red toy brick", 0.035, {"studs": (2, 4), "color": RED}),
        Variant("toy_brick_blue", "the blue toy brick", 0.020,
            {"studs": (2, 2), "color": BLUE, "pitch_m": 0.018, "height_m": 0.022}),
        Variant("toy_brick_yellow", "the long yellow toy brick", 0.050, {"studs": (2, 6), "color": YELLOW}),
    )),
    Kind("letter_block", "boxes:letter_block", (
        Variant("letter_block_green", "the wooden letter block A", 0.055, {
            "edge_m": 0.045, "color": CREAM, "letters": "ABC", "frame": GREEN}),
        Variant("letter_block_red", "the wooden letter block X", 0.055, {
            "edge_m": 0.045, "color": CREAM, "letters": "XYZ", "frame": RED}),
        Variant("letter_block_blue", "the small wooden number block", 0.038, {
            "edge_m": 0.040, "color": CREAM, "letters": "123", "frame": BLUE}),
    )),
    Kind("ball", "toys:ball", (
        Variant("ball_red", "the red and white ball", 0.07, {"radius_m": 0.032, "colors": (RED, WHITE)}),
        Variant("ball_striped", "the blue and yellow ball", 0.055,
            {"radius_m": 0.028, "colors": (BLUE, YELLOW, SKY)}),
        Variant("ball_green", "the big green and white ball", 0.085,
            {"radius_m": 0.036, "colors": (GREEN, WHITE)}),
    ), rolls=True),
    Kind("die", "boxes:die", (
        Variant("die_white", "the big white die", 0.045, {"edge_m": 0.038, "color": WHITE, "pips": BLACK}),
        Variant("die_red", "the big red die", 0.035, {"edge_m": 0.034, "color": RED, "pips": WHITE}),
        Variant("die_blue", "the huge blue die", 0.060, {"edge_m": 0.046, "color": BLUE, "pips": WHITE}),
    )),
    Kind("toy_car", "toys:toy_car", (
        Variant("toy_car_blue", "the blue toy car", 0.09, {"length_m": 0.105, "color": BLUE}),
        Variant("toy_car_yellow", "the yellow toy car", 0.06, {"length_m": 0.085, "color": YELLOW}),
        Variant("toy_car_red", "the big red toy car", 0.13, {"length_m": 0.125, "color": RED}),
    )),
    Kind("remote_control", "boxes:remote_control", (
        Variant("remote_control_black", "the black remote control", 0.11, {
            "size_m": (0.165, 0.045, 0.020), "color": "#26282c", "buttons": "#c9ccd1", "accent": RED}),
        Variant("remote_control_white", "the white remote control", 0.08, {
            "size_m": (0.130, 0.040, 0.018), "color": "#eceff2", "buttons": "#555b66", "accent": GREEN}),
        Variant("remote_control_grey", "the long grey remote control", 0.13, {
            "size_m": (0.190, 0.050, 0.022), "color": "#7d838b", "buttons": "#f2f3f5", "accent": ORANGE}),
    )),
    Kind("marker", "bottles:marker", (
        Variant("marker_blue", "the blue marker", 0.022, {
            "length_m": 0.138, "radius_m": 0.0095, "color": BLUE, "barrel": WHITE, "text": "MARKER"}),
        Variant("marker_purple", "the purple marker", 0.028, {
            "length_m": 0.125, "radius_m": 0.011, "color": PURPLE, "barrel": CREAM, "text": "MARKER"}),
        Variant("marker_green", "the thick green marker", 0.030, {
            "length_m": 0.120, "radius_m": 0.0125, "color": GREEN, "barrel": WHITE, "text": "PAINT"}),
    ), rolls=True),
    Kind("tape_roll", "vessels:tape_roll", (
        Variant("tape_roll_brown", "the roll of brown packing tape", 0.19, {
            "radius_m": 0.050, "hole_m": 0.038, "width_m": 0.048, "color": "#a8733c", "core": "#d9c39a"}),
        Variant("tape_roll_grey", "the roll of grey tape", 0.15, {
            "radius_m": 0.045, "hole_m": 0.030, "width_m": 0.036, "color": GRAY, "core": "#e6e1d6"}),
        Variant("tape_roll_red", "the roll of red tape", 0.085, {
            "radius_m": 0.040, "hole_m": 0.026, "width_m": 0.024, "color": RED, "core": WHITE}),
    ), held_out=True),
)  # fmt: skip
