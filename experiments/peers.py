"""Normals of clouds in the format of src/exchange.rs by OpenCV and D2NT.

Writes NAME.PEER.normals beside each NAME.cloud, and prints "skipped: PEER" for a peer that is not installed.
"""

import sys

try:
    import cv2
    import numpy
except ImportError:
    print("skipped: OpenCV\nskipped: D2NT")  # which needs both
    sys.exit()
try:
    import d2nt
except ImportError:
    d2nt = None
    print("skipped: D2NT")

# Name, method and window. 5 is OpenCV's default and 7 its largest; LINEMOD and CROSS_PRODUCT have no window to choose.
OPENCV = [
    ("OpenCV-FALS-5", "FALS", 5),
    ("OpenCV-FALS-7", "FALS", 7),
    ("OpenCV-SRI-5", "SRI", 5),
    ("OpenCV-SRI-7", "SRI", 7),
    ("OpenCV-LINEMOD", "LINEMOD", 5),
    ("OpenCV-CROSS", "CROSS_PRODUCT", 5),
]
D2NT = [("D2NT-v2", "d2nt_v2"), ("D2NT-v3", "d2nt_v3")]


def read(path):
    """The points, height x width x 3, and the camera's matrix."""
    with open(path, "rb") as file:
        width, height, focal, x, y = map(float, file.readline().split())
        points = numpy.fromfile(file, "<f4").reshape(int(height), int(width), 3)
    return points, numpy.array([[focal, 0, x], [0, focal, y], [0, 0, 1]])


def opencv(points, camera, method, window):
    # In millimetres: the default threshold of LINEMOD, 50, is meant so.
    millimetres = numpy.zeros(points.shape[:2] + (4,), numpy.float32)
    millimetres[..., :3] = 1000 * points
    number = getattr(cv2, "RgbdNormals_RGBD_NORMALS_METHOD_" + method)
    rows, columns = points.shape[:2]
    estimator = cv2.RgbdNormals.create(rows, columns, cv2.CV_32F, camera, window, 50.0, number)
    return estimator.apply(millimetres)[..., :3]


def from_d2nt(points, camera, version):
    # Its pixels count from 1.
    camera = camera + numpy.array([[0, 0, 1], [0, 0, 1], [0, 0, 0]])
    return d2nt.depth2normal(points[..., 2], camera, version=version)


for path in sys.argv[1:]:
    points, camera = read(path)
    peers = [(name, opencv, arguments) for name, *arguments in OPENCV]
    if d2nt:
        peers += [(name, from_d2nt, arguments) for name, *arguments in D2NT]
    for name, function, arguments in peers:
        normals = function(points, camera, *arguments).astype("<f4")
        normals.tofile(f"{path.removesuffix('.cloud')}.{name}.normals")
