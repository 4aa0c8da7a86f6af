// iine's class for clouds of pcl::PointXYZ, and what tests do with it.

#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include <pcl/point_types.h>

#include <iine/pcl/integral_image_normal.h>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;
using Estimator = iine::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>;
constexpr float NaN = std::numeric_limits<float>::quiet_NaN ();

inline std::size_t
countNormals (const Normals &normals)
{
  std::size_t count = 0;
  for (const auto &normal : normals)
    count += std::isfinite (normal.normal_x);
  return count;
}

inline Normals
compute (Estimator &estimator)
{
  Normals normals;
  estimator.compute (normals);
  return normals;
}
