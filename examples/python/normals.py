#!/usr/bin/env python3
"""The C API by ctypes, on a small plane: prints the normal in its middle."""

import array
import ctypes

iine = ctypes.CDLL("libiine.so.0.1")  # by its SONAME: the structs are this version's, see iine/iine.h
iine.iine_status_string.restype = ctypes.c_char_p
# ctypes must be told of arguments that are not integers or pointers; so it must for the other setters that take floats.
iine.iine_estimator_set_normal_smoothing_size.argtypes = ctypes.c_void_p, ctypes.c_float


class Points(ctypes.Structure):
    _fields_ = [("struct_size", ctypes.c_size_t), ("width", ctypes.c_uint32), ("height", ctypes.c_uint32),
                ("x", ctypes.c_void_p), ("y", ctypes.c_void_p), ("z", ctypes.c_void_p),
                ("point_stride", ctypes.c_size_t), ("row_stride", ctypes.c_size_t)]


class Normals(ctypes.Structure):
    _fields_ = [("struct_size", ctypes.c_size_t),
                ("nx", ctypes.c_void_p), ("ny", ctypes.c_void_p), ("nz", ctypes.c_void_p),
                ("point_stride", ctypes.c_size_t), ("row_stride", ctypes.c_size_t), ("curvature", ctypes.c_void_p),
                ("curvature_point_stride", ctypes.c_size_t), ("curvature_row_stride", ctypes.c_size_t)]


def check(status):
    if status != 0:
        raise RuntimeError(iine.iine_status_string(status).decode())


WIDTH, HEIGHT = 64, 48
cloud = array.array("f")
for row in range(HEIGHT):
    for column in range(WIDTH):
        x, y = 0.01 * column, 0.01 * row
        cloud.extend((x, y, 2.0 - 0.75 * x))
result = array.array("f", bytes(4 * len(cloud)))

p, n = cloud.buffer_info()[0], result.buffer_info()[0]
points = Points(ctypes.sizeof(Points), WIDTH, HEIGHT, p, p + 4, p + 8, 12, 0)
normals = Normals(ctypes.sizeof(Normals), n, n + 4, n + 8, 12)
estimator = ctypes.c_void_p()
check(iine.iine_estimator_new(ctypes.byref(estimator)))
check(iine.iine_estimator_set_normal_smoothing_size(estimator, 8))
check(iine.iine_estimator_compute(estimator, ctypes.byref(points), ctypes.byref(normals)))
iine.iine_estimator_free(estimator)

middle = 3 * (HEIGHT // 2 * WIDTH + WIDTH // 2)
print("normal in the middle: (%.3f, %.3f, %.3f)" % tuple(result[middle:middle + 3]))
