// The cross-check on real frames: IINE_TEST_DATA, else ../shared/data beside the project.

#include <fstream>

#include <pcl/io/pcd_io.h>

#include "cross_check.h"

namespace
{
  template <typename PointT> void
  run (const std::string &name)
  {
    const char *const directory = std::getenv ("IINE_TEST_DATA");
    const std::string path = std::string (directory != nullptr ? directory : IINE_DEFAULT_TEST_DATA) + "/" + name + ".pcd";
    if (!std::ifstream (path))
      GTEST_SKIP () << name << ": no " << path << " (set IINE_TEST_DATA)";
    typename pcl::PointCloud<PointT>::Ptr cloud (new pcl::PointCloud<PointT>);
    ASSERT_EQ (pcl::io::loadPCDFile (path, *cloud), 0) << path;
    cross_check::Report report (name);
    cross_check::Comparison<PointT> comparison (cloud);
    for (const cross_check::Config &config : cross_check::configs ())
    {
      cross_check::Row row = comparison.run (config);
      cross_check::check (row, config, true);
      report.add (name, config, row);
    }
  }
}

TEST (CrossCheckFrames, TheTwoClassesAreDifferentOnes)
{
  const pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> pcl_class;
  const iine::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> our_class;
  const std::string pcl_name = typeid (pcl_class).name (), our_name = typeid (our_class).name ();
  EXPECT_EQ (pcl_name.find ("N3pcl29IntegralImageNormalEstimation"), 0u) << pcl_name;
  EXPECT_EQ (our_name.find ("N4iine29IntegralImageNormalEstimation"), 0u) << our_name;
}

TEST (CrossCheckFrames, table_scene_mug_stereo_textured)
{
  run<pcl::PointXYZRGBA> ("table_scene_mug_stereo_textured");
}
TEST (CrossCheckFrames, office1) { run<pcl::PointXYZRGB> ("office1"); }
TEST (CrossCheckFrames, milk_cartoon_all_small_clorox) { run<pcl::PointXYZRGBA> ("milk_cartoon_all_small_clorox"); }
TEST (CrossCheckFrames, kinect_capture0001) { run<pcl::PointXYZ> ("kinect_capture0001"); }
TEST (CrossCheckFrames, realsense_d435) { run<pcl::PointXYZ> ("realsense_d435"); }
TEST (CrossCheckFrames, ouster_os1_128) { run<pcl::PointXYZ> ("ouster_os1_128"); }
