// The cross-check on generated clouds, in three point types.

#include "cross_check.h"
#include "generated_clouds.h"

namespace
{
  template <typename PointT> typename pcl::PointCloud<PointT>::Ptr
  toCloud (const generated::Points &from)
  {
    typename pcl::PointCloud<PointT>::Ptr cloud (new pcl::PointCloud<PointT> (from.width, from.height));
    for (std::size_t i = 0; i < from.points.size (); ++i)
      (*cloud)[i].getVector3fMap () = from.points[i];
    cloud->header.seq = 17;
    cloud->header.stamp = 4711;
    cloud->header.frame_id = "camera";
    cloud->sensor_origin_ = Eigen::Vector4f (0.1f, -0.2f, 0.05f, 0.0f);
    cloud->sensor_orientation_ = Eigen::Quaternionf (0.5f, 0.5f, -0.5f, 0.5f);
    return cloud;
  }

  template <typename PointT> void
  run (const std::string &name, const std::vector<generated::Points> &clouds)
  {
    cross_check::Report report (name);
    for (const generated::Points &points : clouds)
    {
      SCOPED_TRACE (points.name);
      cross_check::Comparison<PointT> comparison (toCloud<PointT> (points));
      for (const cross_check::Config &config : cross_check::configs ())
      {
        cross_check::Row row = comparison.run (config);
        cross_check::check (row, config, false);
        report.add (points.name, config, row);
      }
    }
  }
}

TEST (CrossCheckGenerated, Planes) { run<pcl::PointXYZ> ("planes", generated::planes ()); }
TEST (CrossCheckGenerated, Surfaces) { run<pcl::PointXYZ> ("surfaces", generated::surfaces ()); }
TEST (CrossCheckGenerated, SurfacesXYZRGBA) { run<pcl::PointXYZRGBA> ("surfaces_xyzrgba", generated::surfaces ()); }
TEST (CrossCheckGenerated, SurfacesXYZRGBNormal)
{
  run<pcl::PointXYZRGBNormal> ("surfaces_xyzrgbnormal", generated::surfaces ());
}
TEST (CrossCheckGenerated, Oddities) { run<pcl::PointXYZ> ("oddities", generated::oddities ()); }
TEST (CrossCheckGenerated, Sizes) { run<pcl::PointXYZ> ("sizes", generated::sizes ()); }
