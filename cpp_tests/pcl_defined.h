// Where PCL's class itself is defined: nothing outside the image is read or written for a pixel.
//
// Confirmed with PCL's class compiled under AddressSanitizer (target cross_check_asan).

#pragma once

#include "reference.h"

namespace pcl_defined
{
  /** \brief What the predicates need to know of a configuration and an image. */
  struct Setting
  {
    reference::Method method;
    bool mirror;
    int width;
    int height;
  };

  /** \brief Whether the elements [start, end) of a window lie in 0 .. limit - 1 after mirroring, if any. */
  inline bool
  isWindowInside (int start, int end, int limit, bool mirror)
  {
    if (!mirror)
      return start >= 0 && end <= limit;
    if (start < 0)
      return end <= limit && -start <= limit; // one border only: the other end is not folded
    return start <= limit && (end < limit || 2 * limit - 1 - end >= 0);
  }

  /** \brief Whether a single point lies in 0 .. limit - 1 after mirroring, if any. */
  inline bool
  isPointInside (int at, int limit, bool mirror)
  {
    const int folded = reference::fold (at, limit, mirror);
    return folded >= 0 && folded < limit;
  }

  /** \brief Whether PCL stays inside the image for pixel (x, y) with a window of \a side pixels. */
  inline bool
  isPixelDefined (const Setting &setting, int x, int y, int side)
  {
    const int half = side / 2, quarter = side / 4;
    const auto columns = [&] (int start, int size)
    { return isWindowInside (start, start + size, setting.width, setting.mirror); };
    const auto rows = [&] (int start, int size)
    { return isWindowInside (start, start + size, setting.height, setting.mirror); };
    const auto point = [&] (int px, int py)
    {
      return isPointInside (px, setting.width, setting.mirror) && isPointInside (py, setting.height, setting.mirror);
    };
    switch (setting.method)
    {
      case reference::COVARIANCE_MATRIX:
      case reference::AVERAGE_3D_GRADIENT:
        return columns (x - half, side) && rows (y - half, side);
      case reference::AVERAGE_DEPTH_CHANGE:
        return columns (x - half, half) && columns (x + 1, half) && columns (x - quarter, half)
            && rows (y - half, half) && rows (y + 1, half) && rows (y - quarter, half)
            && point (x - quarter - 1, y) && point (x + quarter + 1, y)
            && point (x - 1, y - quarter) && point (x + 1, y + quarter);
      default:
        return columns (x - half, side) && columns (x + half, 1) && rows (y - half, side) && rows (y + half, 1);
    }
  }

  /** \brief Whether PCL can be given the image at all: AVERAGE_3D_GRADIENT counts to width - 2, unsigned. */
  inline bool
  isImageDefined (const Setting &setting)
  {
    return setting.method != reference::AVERAGE_3D_GRADIENT || setting.width >= 2;
  }

  /** \brief Whether PCL's path for the whole cloud can clear the ignored border: it counts to size - border,
    * unsigned, and writes before the output if the border is larger than the image. */
  inline bool
  isBorderDefined (const Setting &setting, int border)
  {
    return setting.mirror || (border <= setting.width && border <= setting.height);
  }

  /** \brief Whether the path for indices treats a pixel as inside the border that the path for the whole cloud
    * ignores: its test is off by one row and one column at the far side. */
  inline bool
  isBorderOffByOne (const Setting &setting, int border, int x, int y)
  {
    if (setting.mirror)
      return false;
    const auto inside = [&] (int at, int size, int far) { return at >= border && at < size - border + far; };
    return inside (x, setting.width, 1) && inside (y, setting.height, 1)
        && !(inside (x, setting.width, 0) && inside (y, setting.height, 0));
  }
}
