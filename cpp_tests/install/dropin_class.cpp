// iine::pcl_dropin: PCL's header and name, our class.

#include <pcl/features/integral_image_normal.h>
#include <pcl/point_types.h>

#include <iine/pcl/integral_image_normal.h>

#include <type_traits>

static_assert(std::is_same<pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>,
                           iine::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal>>::value,
              "one class");

int main()
{
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>(64, 48));
  for (unsigned row = 0; row < cloud->height; ++row)
    for (unsigned column = 0; column < cloud->width; ++column)
      cloud->at(column, row) = pcl::PointXYZ(0.01f * column, 0.01f * row, 1.0f);
  pcl::PointCloud<pcl::Normal> normals;
  pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.compute(normals);
  return normals.at(32, 24).normal_z < -0.999f ? 0 : 1;
}
