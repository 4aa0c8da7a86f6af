// iine::pcl without the drop-in: both classes side by side, and two different ones.

#include <iine/pcl/integral_image_normal.h>

#include <pcl/features/integral_image_normal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <iostream>
#include <type_traits>

#ifdef IINE_PCL_DROPIN
#error "the drop-in header was found without asking for it"
#endif

using Ours = iine::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>;
using Pcls = pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>;
static_assert(!std::is_same<Ours, Pcls>::value, "two classes");

template <typename Estimation> pcl::Normal centerNormal()
{
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>(64, 48));
  for (unsigned row = 0; row < cloud->height; ++row)
    for (unsigned column = 0; column < cloud->width; ++column)
      cloud->at(column, row) = pcl::PointXYZ(0.01f * column, 0.01f * row, 1.0f);
  pcl::PointCloud<pcl::Normal> normals;
  Estimation estimation;
  estimation.setInputCloud(cloud);
  estimation.compute(normals);
  return normals.at(32, 24);
}

int main()
{
  const pcl::Normal ours = centerNormal<Ours>(), pcls = centerNormal<Pcls>();
  std::cout << "ours " << ours << "\nPCL's " << pcls << "\n";
  return ours.normal_z < -0.999f && pcls.normal_z < -0.999f ? 0 : 1;
}
