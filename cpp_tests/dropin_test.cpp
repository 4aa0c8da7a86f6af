// Sources that know nothing of iine, built with iine::pcl_dropin: whose class they run.

#include <cmath>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <vector>

#include <gtest/gtest.h>

#include <pcl/features/integral_image_normal.h>
#include <pcl/features/impl/integral_image_normal.hpp>
#include <pcl/keypoints/harris_3d.h>
#include <pcl/keypoints/trajkovic_3d.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/edge_aware_plane_comparator.h>
#include <pcl/segmentation/organized_multi_plane_segmentation.h>

namespace
{
  /** \brief Two planes that meet in the middle columns. */
  template <typename PointT> typename pcl::PointCloud<PointT>::Ptr
  roof ()
  {
    const int width = 160, height = 120;
    typename pcl::PointCloud<PointT>::Ptr cloud (new pcl::PointCloud<PointT> (width, height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
      {
        const float u = static_cast<float> (x - width / 2) / 150.0f, v = static_cast<float> (y - height / 2) / 150.0f;
        const float z = 1.5f / (1.0f - 0.6f * std::abs (u));
        auto &point = (*cloud) (x, y);
        point.x = u * z;
        point.y = v * z;
        point.z = z;
      }
    return cloud;
  }
}

TEST (Dropin, PclsNameIsOurClass)
{
  const pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimator;
  EXPECT_EQ (std::string (typeid (estimator).name ()).find ("N4iine29IntegralImageNormalEstimation"), 0u);
  static_assert (std::is_same<pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>,
                              iine::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> >::value, "");
}

TEST (Dropin, TheTutorialsLinesRunOurs)
{
  const auto cloud = roof<pcl::PointXYZ> ();
  pcl::PointCloud<pcl::Normal>::Ptr normals (new pcl::PointCloud<pcl::Normal>);
  pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> ne;
  ne.setNormalEstimationMethod (ne.AVERAGE_3D_GRADIENT);
  ne.setMaxDepthChangeFactor (0.02f);
  ne.setNormalSmoothingSize (10.0f);
  ne.setInputCloud (cloud);
  ne.compute (*normals);
  EXPECT_EQ (ne.getLastStatus (), IINE_OK); // there is no such member in PCL's class
  const pcl::Normal &left = (*normals) (40, 60), &right = (*normals) (120, 60);
  EXPECT_NEAR (left.normal_x, -right.normal_x, 0.05f);
  EXPECT_LT (left.normal_z, -0.5f);
}

TEST (Dropin, PclsIntegralImageStaysAvailable)
{
  const std::vector<float> values {1, 2, 3, 4};
  pcl::IntegralImage2D<float, 1> image (false);
  image.setInput (values.data (), 2, 2, 1, 2);
  EXPECT_EQ (image.getFirstOrderSum (0, 0, 2, 2), 10.0);
}

TEST (Dropin, EdgeAwarePlanesOverOurDistanceMap)
{
  const auto cloud = roof<pcl::PointXYZRGBA> ();
  pcl::PointCloud<pcl::Normal>::Ptr normals (new pcl::PointCloud<pcl::Normal>);
  pcl::IntegralImageNormalEstimation<pcl::PointXYZRGBA, pcl::Normal> ne;
  ne.setNormalEstimationMethod (ne.COVARIANCE_MATRIX);
  ne.setMaxDepthChangeFactor (0.02f);
  ne.setNormalSmoothingSize (20.0f);
  ne.setInputCloud (cloud);
  ne.compute (*normals);
  pcl::EdgeAwarePlaneComparator<pcl::PointXYZRGBA, pcl::Normal>::Ptr comparator (
      new pcl::EdgeAwarePlaneComparator<pcl::PointXYZRGBA, pcl::Normal>);
  ASSERT_NE (ne.getDistanceMap (), nullptr);
  comparator->setDistanceMap (ne.getDistanceMap ());
  pcl::OrganizedMultiPlaneSegmentation<pcl::PointXYZRGBA, pcl::Normal, pcl::Label> segmentation;
  segmentation.setMinInliers (500);
  segmentation.setAngularThreshold (0.05);
  segmentation.setDistanceThreshold (0.02);
  segmentation.setInputNormals (normals);
  segmentation.setInputCloud (cloud);
  segmentation.setComparator (comparator);
  std::vector<pcl::PlanarRegion<pcl::PointXYZRGBA>, Eigen::aligned_allocator<pcl::PlanarRegion<pcl::PointXYZRGBA> > >
      regions;
  segmentation.segmentAndRefine (regions);
  EXPECT_EQ (regions.size (), 2u);
}

TEST (Dropin, KeypointsOfPclCompileWithOurs)
{
  const auto cloud = roof<pcl::PointXYZ> ();
  pcl::TrajkovicKeypoint3D<pcl::PointXYZ, pcl::PointXYZI> trajkovic;
  trajkovic.setInputCloud (cloud);
  pcl::PointCloud<pcl::PointXYZI> keypoints;
  trajkovic.compute (keypoints);
  pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI> harris;
  harris.setInputCloud (cloud);
  harris.setRadius (0.03f);
  harris.compute (keypoints);
}
