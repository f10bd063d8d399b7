"""Pairs of patches that show one point in two views of a scene made of photographs.

A scene is a background and up to five pieces of photographs in front of it. Each layer moves by a
homography of its own between the two views, so that a patch at the rim of a piece changes as at the
rim of an object. Both views then get their own light, blur, noise and compression. Corners and blobs
are detected in each view as the describer does it (front_end/describer.cc, blobs.cc), so that the
pairs have the errors of place and scale that real detections have.
"""

import collections

import cv2
import numpy

WIDTH, HEIGHT = 640, 480
SCALE = 1.2  # between two octaves, as in core/descriptor.h
OCTAVES = 8
LEVELS = OCTAVES + 4
PATCH = 32
CORNER_STEP = SCALE**2  # px of the octave for one px of the patch, as in describer.cc
BLOB_STEP = 0.5  # sigmas, as in describer.cc
MAX_OCTAVES_APART = 1.6
ROLL_SIGMA = 0.06  # rad, of the direction of gravity
CORNERS, BLOBS = 1000, 900

Pairs = collections.namedtuple("Pairs", "first second places")  # places: x, y, step in the first


def shift(x, y):
    matrix = numpy.eye(3)
    matrix[:2, 2] = x, y
    return matrix


def random_homography(rng, shape, scales, roll_deg, strength):
    """From an image of this shape to the view, about the middle of both."""
    height, width = shape
    scale = numpy.exp(rng.uniform(*numpy.log(scales)))
    angle = numpy.radians(rng.normal(0, roll_deg))
    c, s = numpy.cos(angle) * scale, numpy.sin(angle) * scale
    shear = rng.uniform(-0.25, 0.25) * strength
    aspect = numpy.exp(rng.uniform(-0.35, 0.35) * strength)
    affine = numpy.array([[c * aspect, -s + shear * scale, 0], [s * aspect, c, 0], [0, 0, 1.0]])
    tilt = numpy.eye(3)
    tilt[2, :2] = rng.uniform(-1, 1, 2) * 5e-4 * strength
    return shift(WIDTH / 2, HEIGHT / 2) @ tilt @ affine @ shift(-width / 2, -height / 2)


def motion_kernel(rng):
    size = int(rng.integers(3, 9))
    kernel = numpy.zeros((size, size), numpy.float32)
    angle, middle = rng.uniform(0, numpy.pi), (size - 1) / 2
    ends = [
        tuple(int(round(middle + sign * middle * f)) for f in (numpy.cos(angle), numpy.sin(angle)))
        for sign in (-1, 1)
    ]
    cv2.line(kernel, *ends, 1)
    return kernel / kernel.sum()


def degraded(rng, view):
    """The view as a camera would give it."""
    x = view.astype(numpy.float32)
    if rng.random() < 0.5:
        x = cv2.GaussianBlur(x, (0, 0), rng.uniform(0.3, 1.3))
    if rng.random() < 0.35:
        x = cv2.filter2D(x, -1, motion_kernel(rng))
    x = 255 * (numpy.clip(x, 0, 255) / 255) ** numpy.exp(rng.uniform(-0.6, 0.6))
    rows, columns = numpy.mgrid[0:HEIGHT, 0:WIDTH].astype(numpy.float32)
    x *= (
        1
        + rng.uniform(-0.35, 0.35) * (columns / WIDTH - 0.5)
        + rng.uniform(-0.35, 0.35) * (rows / HEIGHT - 0.5)
    )
    x = x * numpy.exp(rng.uniform(-0.7, 0.35)) + rng.uniform(-15, 25)
    x += rng.normal(0, rng.uniform(0.5, 6), x.shape).astype(numpy.float32)
    x = numpy.clip(x, 0, 255).astype(numpy.uint8)
    if rng.random() < 0.4:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(35, 95))]
        x = cv2.imdecode(cv2.imencode(".jpg", x, quality)[1], cv2.IMREAD_GRAYSCALE)
    return x


def pyramid(image):
    levels = [image]
    for octave in range(1, LEVELS):
        size = [int(round(side / SCALE**octave)) for side in (image.shape[1], image.shape[0])]
        levels.append(cv2.resize(levels[-1], size, interpolation=cv2.INTER_LINEAR_EXACT))
    return levels


def corners(levels):
    """FAST corners spread over cells of each octave: rows of x, y, scale."""
    shares = SCALE ** -numpy.arange(OCTAVES, dtype=float)
    found = []
    for octave in range(OCTAVES):
        level, border = levels[octave], 16
        points = numpy.array(
            [(*p.pt, p.response) for p in cv2.FastFeatureDetector_create(7, True).detect(level)]
        ).reshape(-1, 3)
        inside = (points[:, :2] >= border).all(1)
        inside &= points[:, 0] < level.shape[1] - border
        inside &= points[:, 1] < level.shape[0] - border
        points = points[inside]
        points = points[numpy.argsort(-points[:, 2], kind="stable")]
        in_cell, rank = collections.Counter(), []
        for cell in map(tuple, (points[:, :2] // 40).astype(int)):
            rank.append(in_cell[cell])
            in_cell[cell] += 1
        wanted = int(round(CORNERS * shares[octave] / shares.sum()))
        points = points[numpy.argsort(rank, kind="stable")[:wanted]]
        to_image = numpy.array(levels[0].shape[::-1]) / level.shape[::-1]
        places = (points[:, :2] + 0.5) * to_image - 0.5
        found.append(numpy.c_[places, numpy.full(len(places), SCALE**octave)])
    return numpy.concatenate(found)


def blobs(image):
    """Extrema of differences of Gaussians, each place once: rows of x, y, sigma."""
    found = {}
    for point in sorted(cv2.SIFT_create(BLOBS, 2).detect(image, None), key=lambda p: -p.response):
        place = tuple(round(value, 1) for value in point.pt)
        found.setdefault(place, (*point.pt, point.size / 2))
    return numpy.array(list(found.values())).reshape(-1, 3)


def sample(levels, points, steps, angles):
    """Patches around the points, each from the coarsest level not coarser than the patch."""
    patches = numpy.empty((len(points), PATCH, PATCH), numpy.uint8)
    middle = (PATCH - 1) / 2
    for i, (point, step, angle) in enumerate(zip(points, steps, angles)):
        octave = int(numpy.clip(numpy.log(step) / numpy.log(SCALE) + 1e-6, 0, LEVELS - 1))
        level = levels[octave]
        to_level = numpy.array(level.shape[::-1]) / levels[0].shape[::-1]
        x, y = (point[:2] + 0.5) * to_level - 0.5
        c, s = step * to_level[0] * numpy.array([numpy.cos(angle), numpy.sin(angle)])
        matrix = numpy.array(
            [[c, -s, x - (c - s) * middle], [s, c, y - (s + c) * middle]]
        )
        patches[i] = cv2.warpAffine(
            level,
            matrix,
            (PATCH, PATCH),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
    return patches


def piece_mask(rng, shape):
    """A polygon about the middle of a photograph."""
    height, width = shape
    corners_of = int(rng.integers(3, 9))
    angles = numpy.sort(rng.uniform(0, 2 * numpy.pi, corners_of))
    radii = rng.uniform(0.25, 0.5, corners_of)
    polygon = numpy.c_[
        width / 2 + numpy.cos(angles) * radii * width,
        height / 2 + numpy.sin(angles) * radii * height,
    ]
    mask = numpy.zeros(shape, numpy.uint8)
    cv2.fillPoly(mask, [polygon.astype(numpy.int32)], 255)
    return mask


def layer_homographies(rng, shape, is_background):
    """From the photograph to each of the two views."""
    if is_background:
        size = max(WIDTH / shape[1], HEIGHT / shape[0]) * rng.uniform(0.9, 2.0)
        offset = numpy.eye(3)
    else:
        size = rng.uniform(0.35, 1.1)
        offset = shift(rng.uniform(-0.4, 0.4) * WIDTH, rng.uniform(-0.4, 0.4) * HEIGHT)
    first = offset @ random_homography(rng, shape, (0.95 * size, 1.05 * size), 3, 0.6)
    change = random_homography(rng, (HEIGHT, WIDTH), (0.62, 1.6), 5, 1.0)
    return first, shift(rng.normal(0, 0.12) * WIDTH, rng.normal(0, 0.08) * HEIGHT) @ change @ first


def draw(rng, photographs):
    """Two views, for each pixel the layer that it shows, and the layers' homographies between."""
    views = [numpy.zeros((HEIGHT, WIDTH), numpy.uint8) for _ in range(2)]
    layers = [numpy.full((HEIGHT, WIDTH), -1) for _ in range(2)]
    between = []
    for layer in range(int(rng.integers(2, 7))):
        image = photographs[int(rng.integers(len(photographs)))]
        homographies = layer_homographies(rng, image.shape, layer == 0)
        mask = numpy.full(image.shape, 255, numpy.uint8) if layer == 0 else piece_mask(rng, image.shape)
        for view, shown, H in zip(views, layers, homographies):
            warped = cv2.warpPerspective(image, H, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT)
            visible = cv2.warpPerspective(
                mask, H, (WIDTH, HEIGHT), flags=cv2.INTER_NEAREST, borderValue=255 * (layer == 0)
            )
            view[visible > 0] = warped[visible > 0]
            shown[visible > 0] = layer
        between.append(homographies[1] @ numpy.linalg.inv(homographies[0]))
    return views, layers, between


def on_layer(points, layers, layer):
    x = numpy.clip(points[:, 0].round().astype(int), 0, WIDTH - 1)
    y = numpy.clip(points[:, 1].round().astype(int), 0, HEIGHT - 1)
    return numpy.flatnonzero(layers[y, x] == layer)


def corresponding(first, second, H, tolerances):
    """Mutually nearest points under H, of about the same size: rows of two indices."""
    if len(first) == 0 or len(second) == 0:
        return numpy.empty((0, 2), int)
    moved = numpy.c_[first[:, :2], numpy.ones(len(first))] @ H.T
    depth = numpy.maximum(moved[:, 2], 1e-3)
    place = moved[:, :2] / depth[:, None]
    size = first[:, 2] * numpy.sqrt(numpy.abs(numpy.linalg.det(H) / depth**3))
    distance = numpy.linalg.norm(place[:, None] - second[None, :, :2], axis=2)
    octaves = numpy.abs(numpy.log(size[:, None] / second[None, :, 2])) / numpy.log(SCALE)
    cost = distance / tolerances + 0.25 * octaves
    cost[(distance > tolerances) | (octaves > MAX_OCTAVES_APART) | (moved[:, 2] < 1e-3)[:, None]] = 1e9
    nearest = cost.argmin(1)
    mutual = cost.argmin(0)[nearest] == numpy.arange(len(first))
    mutual &= cost[numpy.arange(len(first)), nearest] < 1e8
    return numpy.c_[numpy.flatnonzero(mutual), nearest[mutual]]


def pairs_of(rng, levels, layers, between, points, step):
    """Pairs of patches among the points of the two views."""
    found = [numpy.empty((0, 2), int)]
    for layer, H in enumerate(between):
        a, b = (on_layer(points[view], layers[view], layer) for view in (0, 1))
        sizes = points[1][b, 2]
        tolerance = 1.6 * sizes if step == CORNER_STEP else numpy.maximum(0.4 * sizes, 1)
        ab = corresponding(points[0][a], points[1][b], H, tolerance[None])
        found.append(numpy.c_[a[ab[:, 0]], b[ab[:, 1]]])
    chosen = numpy.concatenate(found)
    patches, steps = [], []
    for view in (0, 1):
        of_view = points[view][chosen[:, view]]
        steps.append(numpy.maximum(step * of_view[:, 2], 1))
        angles = rng.normal(0, ROLL_SIGMA, len(of_view))
        patches.append(sample(levels[view], of_view, steps[view], angles))
    return Pairs(*patches, numpy.c_[points[0][chosen[:, 0], :2], steps[0]])


def make_scene(rng, photographs):
    """All pairs of one scene."""
    views, layers, between = draw(rng, photographs)
    levels = [pyramid(degraded(rng, view)) for view in views]
    of_corners = pairs_of(rng, levels, layers, between, [corners(v) for v in levels], CORNER_STEP)
    of_blobs = pairs_of(rng, levels, layers, between, [blobs(v[0]) for v in levels], BLOB_STEP)
    return Pairs(*(numpy.concatenate(both) for both in zip(of_corners, of_blobs)))
