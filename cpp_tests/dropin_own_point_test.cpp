// A user's own point type, as PCL wants it: with PCL_NO_PRECOMPILE.

#define PCL_NO_PRECOMPILE

#include <cmath>

#include <gtest/gtest.h>

#include <pcl/features/integral_image_normal.h>
#include <pcl/point_types.h>

struct OwnPoint
{
  PCL_ADD_POINT4D;
  float weight;
};

POINT_CLOUD_REGISTER_POINT_STRUCT (OwnPoint, (float, x, x) (float, y, y) (float, z, z) (float, weight, weight))

PCL_INSTANTIATE_IntegralImageNormalEstimation (OwnPoint, pcl::Normal)

TEST (DropinOwnPoint, GetsNormals)
{
  pcl::PointCloud<OwnPoint>::Ptr cloud (new pcl::PointCloud<OwnPoint> (40, 30));
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x)
    {
      OwnPoint &point = (*cloud) (x, y);
      point.x = 0.01f * static_cast<float> (x);
      point.y = 0.01f * static_cast<float> (y);
      point.z = 1.0f;
    }
  pcl::IntegralImageNormalEstimation<OwnPoint, pcl::Normal> estimator;
  estimator.setInputCloud (cloud);
  pcl::PointCloud<pcl::Normal> normals;
  estimator.compute (normals);
  EXPECT_NEAR (normals (20, 15).normal_z, -1.0f, 1e-6f);
}
