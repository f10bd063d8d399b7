"""The recordings, and the sessions that combine them. A scene is built around all paths that lead through it."""

from dataclasses import dataclass

from map_merging_lib.ways import Way

MUST, MAY, NEVER = "yes", "may", "never"


@dataclass(frozen=True)
class World:
    """A recording: a path through a scene, and a camera."""

    name: str
    title: str
    scene: tuple  # like pangea-sim's --scene and --scene-seed
    way: Way
    seconds: float = 32
    lens: str = "euroc"
    rate: int = 20  # images per second
    options: tuple = ()  # further options of pangea-sim


@dataclass(frozen=True)
class Session:
    """Recordings that one server receives, and whether they should become one map."""

    names: tuple
    title: str
    fuse: str = MUST

    @property
    def name(self):
        return "+".join(self.names)


PLANT, CORRIDOR, YARD, NIGHT, OFFICE, BARE, ROWS, WALL = (
    ("hall", 201), ("room", 202), ("hall", 203), ("hall", 204), ("room", 205), ("bare", 206), ("rows_a", 207), ("hall", 208))
OTHER_ROWS = ("rows_b", ROWS[1])
ROUND = ((0, 0), (20, 0), (20, 12), (0, 12), (0, 0))
INNER = ((2, 2), (18, 2), (18, 10), (2, 10), (2, 2))
AISLES = ((0, 0), (24, 0), (24, 10), (0, 10), (0, 0))
SMALL = ((0, 0), (5, 0), (5, 3.5), (0, 3.5), (0, 0))
WORLDS = [
    World("plant_walk", "a walk round a hall", PLANT, Way(ROUND), 38),
    World("plant_phone", "a phone, 18 m ahead on the same way", PLANT, Way(ROUND, start=18), 38, "phone", 30),
    World("plant_back", "the same way, walked the other way round", PLANT, Way(ROUND[::-1], start=10), 38),
    World("plant_drone", "a drone 3.5 m above, on an inner round", PLANT, Way(INNER, True, 1.8, 5.0, start=10), 32),
    World("corridor_out", "a walk down a corridor", CORRIDOR, Way(((0, 0), (40, 0)), speed=0.9), 30),
    World("corridor_after", "a phone follows, from 6 m on", CORRIDOR, Way(((0, 0.4), (40, 0.4)), speed=0.9, start=6), 26, "phone", 30),
    World("corridor_back", "a walk back", CORRIDOR, Way(((28, 0.3), (-12, 0.3)), speed=0.9), 30),
    World("rows_walk", "a walk through rows of the same machines", ROWS, Way(AISLES), 28),
    World("rows_drone", "a drone, half of the same way", ROWS, Way(AISLES, True, 1.8, 2.2, start=14), 24),
    World("rows_other", "the same machines, in another hall's rows", OTHER_ROWS, Way(AISLES), 28),
    World("bare_walk", "a walk in a whitewashed hall", BARE, Way(ROUND), 26),
    World("bare_phone", "a phone in it, 8 m ahead", BARE, Way(ROUND, start=8), 24, "phone", 30),
    World("yard_west", "a walk round the west of a long hall", YARD, Way(((0, 0), (16, 0), (16, 12), (0, 12))), 26),
    World("yard_east", "a walk from its middle to the east", YARD, Way(((9, 0.5), (36, 0.5), (36, 12))), 26),
    World("yard_far", "a walk in the east alone", YARD, Way(((25, 7), (32, 7), (32, 16), (20, 16))), 24),
    World("night_drone", "a drone in the dark: 10 ms of exposure", NIGHT, Way(INNER, True, 1.6, 2.5), 24,
          options=("--exposure-ms", "10", "--brightness", "0.25")),
    World("night_phone", "a phone in the dark: 15 ms", NIGHT, Way(INNER, start=5), 26, "phone", 30,
          options=("--exposure-ms", "15", "--brightness", "0.3")),
    World("office_slow", "a walk in a room, 10 images a second", OFFICE, Way(SMALL, speed=0.6), 26, rate=10),
    World("office_wide", "a wide fisheye (TUM-VI's) at 25, 0.4 m lower", OFFICE, Way(SMALL, speed=0.5, height=1.1, start=3), 26,
          "wide", 25),
    World("wall_near", "sideways along a wall, 5 m off", WALL, Way(((0, 0), (40, 0)), looks=-90), 24),
    World("wall_far", "the same, 11 m off", WALL, Way(((0, 6), (40, 6)), looks=-90), 24),
]
SESSIONS = [
    Session(("plant_walk", "plant_phone"), "half the way is common; camera and phone"),
    Session(("plant_walk", "plant_drone"), "3.5 m of height between them"),
    Session(("plant_walk", "plant_back"), "everything is seen from the other side", MAY),
    Session(("plant_walk", "plant_phone", "plant_drone"), "three agents"),
    Session(("corridor_out", "corridor_after"), "one after the other"),
    Session(("corridor_out", "corridor_back"), "out and back", MAY),
    Session(("rows_walk", "rows_drone"), "rows of the same machines"),
    Session(("bare_walk", "bare_phone"), "hardly a mark anywhere"),
    Session(("yard_west", "yard_east"), "7 m of way are common"),
    Session(("yard_west", "yard_far"), "no way is common", MAY),
    Session(("night_drone", "night_phone"), "dark and blurred"),
    Session(("office_slow", "office_wide"), "10 Hz, and a wide lens"),
    Session(("wall_near", "wall_far"), "twice as far", MAY),
    Session(("rows_walk", "rows_other"), "two halls, the same machines in the same rows", NEVER),
    Session(("rows_drone", "rows_other"), "the same", NEVER),
    Session(("plant_walk", "yard_west"), "two halls", NEVER),
    Session(("plant_walk", "corridor_out"), "two buildings", NEVER),
]
