// What callers of PCL's class rely on, and what iine's class adds.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <dirent.h>

#include <gtest/gtest.h>

#include "point_xyz.h"

namespace
{
  /** \brief A tilted, slightly uneven surface with a missing block. */
  template <typename PointT = pcl::PointXYZ> typename pcl::PointCloud<PointT>::Ptr
  scene (int width = 60, int height = 44, float tilt = 0.3f)
  {
    typename pcl::PointCloud<PointT>::Ptr cloud (new pcl::PointCloud<PointT> (width, height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
      {
        const float u = static_cast<float> (x - width / 2) / 60.0f, v = static_cast<float> (y - height / 2) / 60.0f;
        const float z = 1.5f + tilt * u + 0.05f * std::sin (12.0f * v);
        auto &point = (*cloud) (x, y);
        point.x = u * z;
        point.y = v * z;
        point.z = x > 40 && x < 44 && y > 20 && y < 24 ? NaN : z;
      }
    return cloud;
  }

  template <typename A, typename B> bool
  areSame (const A &a, const B &b)
  {
    const auto same = [] (float u, float v) { return u == v || (std::isnan (u) && std::isnan (v)); };
    return same (a.normal_x, b.normal_x) && same (a.normal_y, b.normal_y) && same (a.normal_z, b.normal_z)
        && same (a.curvature, b.curvature);
  }

  ::testing::AssertionResult
  areEqual (const Normals &a, const Normals &b)
  {
    if (a.size () != b.size () || a.width != b.width || a.height != b.height)
      return ::testing::AssertionFailure () << "sizes differ";
    for (std::size_t i = 0; i < a.size (); ++i)
      if (!areSame (a[i], b[i]))
        return ::testing::AssertionFailure () << "normals differ at " << i;
    return ::testing::AssertionSuccess ();
  }

  Normals
  computeFresh (const Cloud::ConstPtr &cloud, Estimator::NormalEstimationMethod method, float size = 10.0f)
  {
    Estimator estimator;
    estimator.setNormalEstimationMethod (method);
    estimator.setNormalSmoothingSize (size);
    estimator.setInputCloud (cloud);
    return compute (estimator);
  }

  /** \brief The normal of a pixel of the scene from a window of this size, by the C API. */
  pcl::Normal
  chosenWindow (Estimator::NormalEstimationMethod method, std::uint32_t x, std::uint32_t y, std::int32_t width,
                std::int32_t height)
  {
    const Cloud::Ptr cloud = scene ();
    pcl::Normal normal;
    iine_points points = {};
    points.struct_size = sizeof (points);
    points.width = cloud->width;
    points.height = cloud->height;
    points.x = &cloud->front ().x;
    points.y = &cloud->front ().y;
    points.z = &cloud->front ().z;
    points.point_stride = sizeof (pcl::PointXYZ);
    iine_normals normals = {};
    normals.struct_size = sizeof (normals);
    normals.nx = &normal.normal_x;
    normals.ny = &normal.normal_y;
    normals.nz = &normal.normal_z;
    normals.point_stride = sizeof (pcl::Normal);
    normals.curvature = &normal.curvature;
    normals.curvature_point_stride = sizeof (pcl::Normal);
    iine_estimator *estimator = nullptr;
    EXPECT_EQ (iine_estimator_new (&estimator), IINE_OK);
    EXPECT_EQ (iine_estimator_set_method (estimator, method), IINE_OK);
    EXPECT_EQ (iine_estimator_compute_window (estimator, &points, x, y, width, height, &normals), IINE_OK);
    iine_estimator_free (estimator);
    return normal;
  }

  /** \brief Whether a call prints this error of one of the class's members. */
  template <typename Call> ::testing::AssertionResult
  prints (const std::string &error, const Call &call)
  {
    ::testing::internal::CaptureStderr ();
    call ();
    const std::string printed = ::testing::internal::GetCapturedStderr ();
    if (printed.find ("[iine::IntegralImageNormalEstimation::" + error + ".\n") != std::string::npos)
      return ::testing::AssertionSuccess ();
    return ::testing::AssertionFailure () << "printed: " << printed;
  }

  /** \brief How many threads the process has. */
  std::size_t
  countThreads ()
  {
    DIR *const tasks = opendir ("/proc/self/task");
    if (tasks == nullptr)
      return 0;
    std::size_t count = 0;
    while (readdir (tasks) != nullptr)
      ++count;
    closedir (tasks);
    return count - 2; // . and ..
  }

  /** \brief Whether the process has so many; one that was waited for may be listed a moment longer. */
  bool
  hasThreads (std::size_t count)
  {
    for (int i = 0; i < 10000 && countThreads () != count; ++i)
      std::this_thread::sleep_for (std::chrono::milliseconds (1));
    return countThreads () == count;
  }

  /** \brief A search tree that says whether anyone gave it a cloud. */
  class WatchedTree : public pcl::search::Search<pcl::PointXYZ>
  {
    public:
      bool is_used = false;

      void
      setInputCloud (const PointCloudConstPtr &, const IndicesConstPtr &) override
      {
        is_used = true;
      }

      int
      nearestKSearch (const pcl::PointXYZ &, int, pcl::Indices &, std::vector<float> &) const override
      {
        return 0;
      }

      int
      radiusSearch (const pcl::PointXYZ &, double, pcl::Indices &, std::vector<float> &, unsigned) const override
      {
        return 0;
      }
  };
}

TEST (Interface, HasPclsMembersWithPclsSignatures)
{
  EXPECT_EQ (Estimator::BORDER_POLICY_IGNORE, 0);
  EXPECT_EQ (Estimator::BORDER_POLICY_MIRROR, 1);
  EXPECT_EQ (Estimator::COVARIANCE_MATRIX, 0);
  EXPECT_EQ (Estimator::AVERAGE_3D_GRADIENT, 1);
  EXPECT_EQ (Estimator::AVERAGE_DEPTH_CHANGE, 2);
  EXPECT_EQ (Estimator::SIMPLE_3D_GRADIENT, 3);
  // As bindings take them.
  void (Estimator::*set_rect_size) (int, int) = &Estimator::setRectSize;
  void (Estimator::*set_border_policy) (Estimator::BorderPolicy) = &Estimator::setBorderPolicy;
  void (Estimator::*point) (int, int, unsigned, pcl::Normal &) = &Estimator::computePointNormal;
  void (Estimator::*mirrored) (int, int, unsigned, pcl::Normal &) = &Estimator::computePointNormalMirror;
  void (Estimator::*set_factor) (float) = &Estimator::setMaxDepthChangeFactor;
  void (Estimator::*set_size) (float) = &Estimator::setNormalSmoothingSize;
  void (Estimator::*set_method) (Estimator::NormalEstimationMethod) = &Estimator::setNormalEstimationMethod;
  void (Estimator::*set_depth_dependent) (bool) = &Estimator::setDepthDependentSmoothing;
  void (Estimator::*set_input) (const Cloud::ConstPtr &) = &Estimator::setInputCloud;
  float *(Estimator::*get_map) () = &Estimator::getDistanceMap;
  void (Estimator::*set_viewpoint) (float, float, float) = &Estimator::setViewPoint;
  void (Estimator::*get_viewpoint) (float &, float &, float &) = &Estimator::getViewPoint;
  void (Estimator::*use_origin) () = &Estimator::useSensorOriginAsViewPoint;
  EXPECT_TRUE (set_rect_size && set_border_policy && point && mirrored && set_factor && set_size && set_method
               && set_depth_dependent && set_input && get_map && set_viewpoint && get_viewpoint && use_origin);
  static_assert (std::is_base_of<pcl::Feature<pcl::PointXYZ, pcl::Normal>, Estimator>::value, "");
  static_assert (std::is_same<Estimator::PointCloudIn, Cloud>::value, "");
  static_assert (std::is_same<Estimator::PointCloudOut, Normals>::value, "");
  static_assert (std::is_copy_constructible<Estimator>::value && std::is_move_assignable<Estimator>::value, "");
  const Estimator::Ptr shared (new Estimator);
  const Estimator::ConstPtr constant = shared;
  EXPECT_EQ (constant->getKSearch (), 1);
}

TEST (Interface, DefaultsArePcls)
{
  Estimator chosen;
  chosen.setNormalEstimationMethod (Estimator::AVERAGE_3D_GRADIENT);
  chosen.setBorderPolicy (Estimator::BORDER_POLICY_IGNORE);
  chosen.setDepthDependentSmoothing (false);
  chosen.setNormalSmoothingSize (10.0f);
  chosen.setMaxDepthChangeFactor (20.0f * 0.001f);
  Estimator plain;
  // Steps up and down by nearly the depth that is a change with the default factor, 2 * 0.02 * (1.5 + 1), and by more.
  const Cloud::Ptr stairs = scene (180, 60, 0.0f);
  for (int i = 0; i < 180 * 60; ++i)
    (*stairs)[i].z = 1.5f + (i % 180 / 20 % 2 == 0 ? 0.0f : 0.0976f + 0.0008f * static_cast<float> (i % 180 / 20));
  for (const Cloud::Ptr &cloud : {scene (), stairs})
  {
    chosen.setInputCloud (cloud);
    plain.setInputCloud (cloud);
    const Normals normals = compute (plain);
    EXPECT_TRUE (areEqual (normals, compute (chosen)));
    EXPECT_GT (countNormals (normals), 100u);
  }
  // The first step up, 0.0984, is none; the last one, 0.1032, is one.
  EXPECT_GT (plain.getDistanceMap ()[30 * 180 + 20], 5.0f);
  EXPECT_EQ (plain.getDistanceMap ()[30 * 180 + 140], 0.0f);
}

TEST (Interface, WorksThroughAFeaturePointer)
{
  const pcl::Feature<pcl::PointXYZ, pcl::Normal>::Ptr feature (new Estimator);
  feature->setInputCloud (scene ());
  feature->setKSearch (0);
  feature->setRadiusSearch (0.03);
  Normals normals;
  feature->compute (normals);
  EXPECT_TRUE (areEqual (normals, computeFresh (scene (), Estimator::AVERAGE_3D_GRADIENT)));
}

TEST (CallOrders, MethodsAreChangedBetweenComputes)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  for (auto method : {Estimator::SIMPLE_3D_GRADIENT, Estimator::COVARIANCE_MATRIX, Estimator::AVERAGE_DEPTH_CHANGE,
                      Estimator::AVERAGE_3D_GRADIENT, Estimator::COVARIANCE_MATRIX})
  {
    estimator.setNormalEstimationMethod (method);
    EXPECT_TRUE (areEqual (compute (estimator), computeFresh (scene (), method)));
  }
}

TEST (CallOrders, OptionsAfterTheCloud)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  estimator.setNormalSmoothingSize (5.0f);
  estimator.setNormalEstimationMethod (Estimator::COVARIANCE_MATRIX);
  EXPECT_TRUE (areEqual (compute (estimator), computeFresh (scene (), Estimator::COVARIANCE_MATRIX, 5.0f)));
}

TEST (CallOrders, IndicesBeforeAndAfterTheCloud)
{
  const pcl::IndicesPtr indices (new pcl::Indices {1000, 1001, 1500, 900});
  Estimator after, before;
  after.setInputCloud (scene ());
  after.setIndices (indices);
  before.setIndices (indices);
  before.setInputCloud (scene ());
  EXPECT_TRUE (areEqual (compute (after), compute (before)));
}

TEST (CallOrders, ReusedForCloudsOfOtherSizes)
{
  Estimator estimator;
  for (auto method : {Estimator::COVARIANCE_MATRIX, Estimator::AVERAGE_3D_GRADIENT, Estimator::SIMPLE_3D_GRADIENT})
    for (const auto &size : std::vector<std::pair<int, int> > {{60, 44}, {44, 60}, {20, 8}, {3, 2}, {1, 5}, {100, 70}})
    {
      const Cloud::Ptr cloud = scene (size.first, size.second);
      estimator.setNormalEstimationMethod (method);
      estimator.setInputCloud (cloud);
      EXPECT_TRUE (areEqual (compute (estimator), computeFresh (cloud, method))) << size.first;
      EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
    }
}

TEST (CallOrders, ScratchMemoryIsKeptUntilItIsReleased)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  estimator.setNumberOfThreads (2);
  const auto before = compute (estimator);
  EXPECT_GT (estimator.getScratchSize (), 0u);
  estimator.releaseScratch ();
  EXPECT_EQ (estimator.getScratchSize (), 0u);
  EXPECT_TRUE (areEqual (compute (estimator), before));
}

TEST (CallOrders, TheCloudIsReadAtCompute)
{
  const Cloud::Ptr cloud = scene ();
  Estimator estimator;
  estimator.setInputCloud (cloud);
  *cloud = *scene (60, 44, -0.6f);
  EXPECT_TRUE (areEqual (compute (estimator), computeFresh (scene (60, 44, -0.6f), Estimator::AVERAGE_3D_GRADIENT)));
}

TEST (Output, SizeHeaderPoseAndDensityAreThoseOfTheCloud)
{
  const Cloud::Ptr cloud = scene ();
  cloud->header.seq = 3;
  cloud->header.stamp = 5;
  cloud->header.frame_id = "camera";
  cloud->sensor_origin_ = Eigen::Vector4f (1.0f, 2.0f, 3.0f, 0.0f);
  cloud->sensor_orientation_ = Eigen::Quaternionf (0.5f, 0.5f, 0.5f, -0.5f);
  const Normals normals = computeFresh (cloud, Estimator::AVERAGE_3D_GRADIENT);
  EXPECT_EQ (normals.width, cloud->width);
  EXPECT_EQ (normals.height, cloud->height);
  EXPECT_FALSE (normals.is_dense);
  EXPECT_EQ (normals.header.seq, 3u);
  EXPECT_EQ (normals.header.stamp, 5u);
  EXPECT_EQ (normals.header.frame_id, "camera");
  EXPECT_EQ (normals.sensor_origin_, cloud->sensor_origin_);
  EXPECT_TRUE (normals.sensor_orientation_.coeffs () == cloud->sensor_orientation_.coeffs ());
}

TEST (Output, MayBeTheInputCloudAndOtherFieldsStay)
{
  using PointT = pcl::PointXYZRGBNormal;
  for (bool use_indices : {false, true})
  {
    const pcl::PointCloud<PointT>::Ptr cloud = scene<PointT> ();
    for (std::size_t i = 0; i < cloud->size (); ++i)
      (*cloud)[i].rgba = static_cast<std::uint32_t> (i * 2654435761u);
    const pcl::PointCloud<PointT> before = *cloud;
    iine::IntegralImageNormalEstimation<PointT, PointT> estimator;
    estimator.setNormalEstimationMethod (decltype (estimator)::COVARIANCE_MATRIX);
    estimator.setInputCloud (cloud);
    const std::size_t last = cloud->size () - 1;
    pcl::IndicesPtr reversed (new pcl::Indices);
    for (std::size_t i = 0; i <= last; ++i)
      reversed->push_back (static_cast<int> (last - i));
    if (use_indices)
      estimator.setIndices (reversed);
    estimator.compute (*cloud);
    ASSERT_EQ (estimator.getLastStatus (), IINE_OK);
    const Normals expected = computeFresh (scene (), Estimator::COVARIANCE_MATRIX);
    for (std::size_t i = 0; i <= last; ++i)
    {
      EXPECT_EQ (std::memcmp ((*cloud)[i].data, before[i].data, sizeof (before[i].data)), 0);
      EXPECT_EQ ((*cloud)[i].rgba, before[i].rgba);
      EXPECT_TRUE (areSame ((*cloud)[i], expected[use_indices ? last - i : i]));
    }
  }
}

TEST (Output, AnInPlaceOutputThatIndicesShrinkIsAnErrorNotACrash)
{
  using PointT = pcl::PointXYZRGBNormal;
  const pcl::PointCloud<PointT>::Ptr cloud = scene<PointT> ();
  iine::IntegralImageNormalEstimation<PointT, PointT> estimator;
  estimator.setInputCloud (cloud);
  estimator.setIndices (pcl::IndicesPtr (new pcl::Indices {5, 1000}));
  estimator.compute (*cloud);
  EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_SIZE);
  EXPECT_TRUE (std::isnan (cloud->front ().normal_x));
}

TEST (Output, AllPointTypesGiveTheSame)
{
  const Normals expected = computeFresh (scene (), Estimator::COVARIANCE_MATRIX);
  iine::IntegralImageNormalEstimation<pcl::PointXYZRGBA, pcl::PointNormal> estimator;
  estimator.setNormalEstimationMethod (decltype (estimator)::COVARIANCE_MATRIX);
  estimator.setInputCloud (scene<pcl::PointXYZRGBA> ());
  pcl::PointCloud<pcl::PointNormal> normals;
  estimator.compute (normals);
  ASSERT_EQ (normals.size (), expected.size ());
  for (std::size_t i = 0; i < normals.size (); ++i)
  {
    EXPECT_EQ (normals[i].x, 0.0f);
    EXPECT_TRUE (areSame (normals[i], expected[i]));
  }
}

TEST (Indices, OutputKBelongsToIndexK)
{
  const Cloud::Ptr cloud = scene ();
  for (auto method : {Estimator::COVARIANCE_MATRIX, Estimator::AVERAGE_3D_GRADIENT})
  {
    const Normals whole = computeFresh (cloud, method);
    const int size = static_cast<int> (cloud->size ());
    pcl::IndicesPtr some (new pcl::Indices), permuted (new pcl::Indices), repeated (new pcl::Indices);
    for (int i = 0; i < size; ++i)
    {
      permuted->push_back (static_cast<int> (static_cast<long> (i) * 1009 % size));
      if (i % 3 == 0)
        some->push_back (i);
    }
    for (int i = 0; i < 2 * size; ++i)
      repeated->push_back (i * 7 % size);
    for (const auto &indices : {some, permuted, repeated})
    {
      Estimator estimator;
      estimator.setNormalEstimationMethod (method);
      estimator.setInputCloud (cloud);
      estimator.setIndices (indices);
      const Normals normals = compute (estimator);
      ASSERT_EQ (normals.size (), indices->size ());
      EXPECT_EQ (normals.width, indices == permuted ? cloud->width : indices->size ());
      EXPECT_EQ (normals.height, indices == permuted ? cloud->height : 1u);
      for (std::size_t k = 0; k < indices->size (); ++k)
        ASSERT_TRUE (areSame (normals[k], whole[(*indices)[k]])) << k;
    }
  }
}

TEST (Indices, NoneGivesNoneAndOnesOutsideAreAnError)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  estimator.setIndices (pcl::IndicesPtr (new pcl::Indices));
  EXPECT_EQ (compute (estimator).size (), 0u);
  EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
  for (int bad : {-1, 60 * 44})
  {
    estimator.setIndices (pcl::IndicesPtr (new pcl::Indices {1000, bad}));
    const Normals normals = compute (estimator);
    EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_INDEX);
    ASSERT_EQ (normals.size (), 2u);
    EXPECT_EQ (countNormals (normals), 0u);
  }
}

TEST (Errors, NoCloud)
{
  Estimator estimator;
  Normals normals (3, 2);
  estimator.compute (normals);
  EXPECT_EQ (normals.size (), 0u);
  EXPECT_EQ (normals.width, 0u);
  EXPECT_EQ (normals.height, 0u);
  EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_NULL_POINTER);
  pcl::Normal normal;
  estimator.computePointNormal (0, 0, 0, normal);
  EXPECT_TRUE (std::isnan (normal.normal_x));
  estimator.setInputCloud (Cloud::ConstPtr ());
  EXPECT_EQ (estimator.getDistanceMap (), nullptr);
}

TEST (Errors, UnorganizedEmptyAndMisshapenClouds)
{
  const Cloud::Ptr unorganized (new Cloud (100, 1)), empty (new Cloud), misshapen = scene ();
  empty->width = 0;
  empty->height = 2;
  misshapen->width += 1;
  for (const auto &cloud : {unorganized, empty, misshapen})
  {
    Estimator estimator;
    estimator.setInputCloud (cloud);
    Normals normals (3, 2);
    estimator.compute (normals);
    EXPECT_EQ (normals.size (), 0u);
    EXPECT_EQ (normals.width, 0u);
    EXPECT_EQ (normals.height, 0u);
    EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_SIZE);
    estimator.setInputCloud (scene ());
    EXPECT_GT (countNormals (compute (estimator)), 100u);
    EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
  }
}

TEST (Errors, RefusedSmoothingSizesLeaveTheOldOne)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  estimator.setNormalSmoothingSize (5.0f);
  for (float bad : {0.0f, -3.0f, NaN, std::numeric_limits<float>::infinity ()})
    estimator.setNormalSmoothingSize (bad);
  EXPECT_TRUE (areEqual (compute (estimator), computeFresh (scene (), Estimator::AVERAGE_3D_GRADIENT, 5.0f)));
}

TEST (Errors, UnknownEnumeratorsThrowInSetInputCloud)
{
  Estimator estimator;
  for (int method : {-1, 4})
  {
    estimator.setNormalEstimationMethod (static_cast<Estimator::NormalEstimationMethod> (method));
    EXPECT_THROW (estimator.setInputCloud (scene ()), pcl::InitFailedException);
    EXPECT_EQ (countNormals (compute (estimator)), 0u);
    EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_OPTION_VALUE);
  }
  estimator.setNormalEstimationMethod (Estimator::AVERAGE_3D_GRADIENT);
  estimator.setBorderPolicy (static_cast<Estimator::BorderPolicy> (2));
  EXPECT_THROW (estimator.setInputCloud (scene ()), pcl::InitFailedException);
  EXPECT_EQ (countNormals (compute (estimator)), 0u);
  estimator.setBorderPolicy (Estimator::BORDER_POLICY_MIRROR);
  EXPECT_NO_THROW (estimator.setInputCloud (scene ()));
  EXPECT_GT (countNormals (compute (estimator)), 100u);
}

TEST (Errors, MirroredSimpleGradientThrows)
{
  Estimator estimator;
  estimator.setNormalEstimationMethod (Estimator::SIMPLE_3D_GRADIENT);
  estimator.setBorderPolicy (Estimator::BORDER_POLICY_MIRROR);
  estimator.setInputCloud (scene ());
  Normals normals;
  EXPECT_THROW (estimator.compute (normals), pcl::PCLException);
  EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_UNSUPPORTED);
  EXPECT_EQ (estimator.getDistanceMap (), nullptr);
  pcl::Normal normal;
  EXPECT_THROW (estimator.computePointNormalMirror (9, 9, 9 * 60 + 9, normal), pcl::PCLException);
  estimator.setBorderPolicy (Estimator::BORDER_POLICY_IGNORE);
  EXPECT_TRUE (areEqual (compute (estimator), computeFresh (scene (), Estimator::SIMPLE_3D_GRADIENT)));
}

TEST (Errors, SayWhatIsWrong)
{
  Estimator e;
  pcl::Normal normal;
  std::vector<float> map;
  const float infinity = std::numeric_limits<float>::infinity ();
  EXPECT_TRUE (prints ("setNormalSmoothingSize] -1 is refused: finite and above 0",
                       [&] () { e.setNormalSmoothingSize (-1.0f); }));
  EXPECT_TRUE (prints ("setPaperAlpha] inf is refused: finite and above 0", [&] () { e.setPaperAlpha (infinity); }));
  EXPECT_TRUE (prints ("setPaperBeta] nan is refused: finite and above 0", [&] () { e.setPaperBeta (NaN); }));
  EXPECT_TRUE (prints ("setPaperGamma] -0.5 is refused: finite and above 0", [&] () { e.setPaperGamma (-0.5f); }));
  EXPECT_TRUE (prints ("setPaperRadii] 5, 4, 9 is refused: 1 <= smallest_radius <= least_depth_radius <= largest_radius "
                       "<= 1000", [&] () { e.setPaperRadii (5, 4, 9); }));
  EXPECT_TRUE (prints ("setNumberOfThreads] 4294967295 is refused: at most 1024",
                       [&] () { e.setNumberOfThreads (std::numeric_limits<unsigned>::max ()); }));
  EXPECT_EQ (e.getLastStatus (), IINE_OK) << "a setter changes it";

  EXPECT_TRUE (prints ("initCompute] no input cloud was set", [&] () { compute (e); }));
  EXPECT_TRUE (prints ("computePointNormal] no input cloud was set",
                       [&] () { e.computePointNormal (9, 9, 9 * 60 + 9, normal); }));
  EXPECT_TRUE (prints ("setInputCloud] the cloud is not organized (height = 1)",
                       [&] () { e.setInputCloud (Cloud::Ptr (new Cloud (100, 1))); }));
  EXPECT_TRUE (prints ("initCompute] the cloud is not organized (height = 1), or its size is not its width times its "
                       "height, or it is empty or too large", [&] () { compute (e); }));
  e.setInputCloud (scene ());
  EXPECT_TRUE (prints ("getDepthRadiusMap] nothing has been computed from this cloud, or the last compute failed",
                       [&] () { e.getDepthRadiusMap (map); }));
  e.setRectSize (-5, 5);
  EXPECT_TRUE (prints ("computePointNormal] -5 x 5 is refused: setRectSize's sizes are 0 or above",
                       [&] () { e.computePointNormal (9, 9, 9 * 60 + 9, normal); }));
  compute (e);
  EXPECT_TRUE (prints ("getDepthRadiusMap] the last compute had SEMANTICS_PCL or SIMPLE_3D_GRADIENT, which have no "
                       "depth radii", [&] () { e.getDepthRadiusMap (map); }));
  EXPECT_TRUE (prints ("getEigenvalueMap] the last compute was not with COVARIANCE_MATRIX, which alone has eigenvalues",
                       [&] () { e.getEigenvalueMap (map); }));
  e.setSemantics (Estimator::SEMANTICS_PAPER);
  e.setNormalEstimationMethod (Estimator::SIMPLE_3D_GRADIENT);
  EXPECT_TRUE (prints ("compute] SIMPLE_3D_GRADIENT does not go with SEMANTICS_PAPER", [&] () { compute (e); }));
  e.setSemantics (static_cast<Estimator::Semantics> (2));
  EXPECT_TRUE (prints ("compute] the method, border policy, semantics, distance metric or depth is none of the "
                       "enumerators", [&] () { compute (e); }));
}

TEST (Viewpoint, IsReadWhereTheCloudIsSetOrAskedFor)
{
  const Cloud::Ptr cloud = scene ();
  cloud->sensor_origin_ = Eigen::Vector4f (1.0f, 2.0f, 30.0f, 0.0f);
  Estimator estimator;
  float x, y, z;
  const auto get = [&] () { estimator.getViewPoint (x, y, z); return Eigen::Vector3f (x, y, z); };
  EXPECT_EQ (get (), Eigen::Vector3f (0, 0, 0));
  estimator.setInputCloud (cloud);
  EXPECT_EQ (get (), Eigen::Vector3f (1, 2, 30));
  const Normals from_behind = compute (estimator);
  cloud->sensor_origin_ = Eigen::Vector4f::Zero ();
  EXPECT_EQ (get (), Eigen::Vector3f (1, 2, 30));
  EXPECT_TRUE (areEqual (compute (estimator), from_behind));
  estimator.useSensorOriginAsViewPoint ();
  EXPECT_EQ (get (), Eigen::Vector3f (0, 0, 0));
  const Normals from_front = compute (estimator);
  const std::size_t center = 12 * 60 + 30;
  EXPECT_EQ (from_behind[center].normal_z, -from_front[center].normal_z);
  estimator.setViewPoint (4, 5, 60);
  EXPECT_EQ (get (), Eigen::Vector3f (4, 5, 60));
  estimator.setInputCloud (cloud);
  EXPECT_EQ (get (), Eigen::Vector3f (4, 5, 60));
  EXPECT_EQ (compute (estimator)[center].normal_z, from_behind[center].normal_z);
  estimator.useSensorOriginAsViewPoint ();
  const Cloud::Ptr later = scene ();
  later->sensor_origin_ = Eigen::Vector4f (7.0f, 8.0f, 9.0f, 0.0f);
  estimator.setInputCloud (later);
  EXPECT_EQ (get (), Eigen::Vector3f (7, 8, 9));
  Estimator without_cloud;
  without_cloud.setViewPoint (1, 1, 1);
  without_cloud.useSensorOriginAsViewPoint ();
  without_cloud.getViewPoint (x, y, z);
  EXPECT_EQ (Eigen::Vector3f (x, y, z), Eigen::Vector3f (0, 0, 0));
}

TEST (DistanceMap, IsThereFromComputeToTheNextCloud)
{
  const Cloud::Ptr cloud = scene ();
  Estimator estimator;
  EXPECT_EQ (estimator.getDistanceMap (), nullptr);
  estimator.setInputCloud (cloud);
  EXPECT_EQ (estimator.getDistanceMap (), nullptr);
  compute (estimator);
  const float *const map = estimator.getDistanceMap ();
  ASSERT_NE (map, nullptr);
  EXPECT_EQ (map, estimator.getDistanceMap ());
  EXPECT_EQ (map[22 * 60 + 42], 0.0f);
  EXPECT_EQ (map[22 * 60 + 50], 6.0f); // the block's last column is 43, its neighbour 44 counts as changed
  const std::vector<float> first (map, map + cloud->size ());
  // The factor at compute counts, not one that is set later.
  compute (estimator);
  estimator.setMaxDepthChangeFactor (1e-6f);
  ASSERT_NE (estimator.getDistanceMap (), nullptr);
  EXPECT_EQ (std::vector<float> (estimator.getDistanceMap (), estimator.getDistanceMap () + cloud->size ()), first);
  compute (estimator);
  EXPECT_NE (std::vector<float> (estimator.getDistanceMap (), estimator.getDistanceMap () + cloud->size ()), first);
  estimator.setInputCloud (cloud);
  EXPECT_EQ (estimator.getDistanceMap (), nullptr);
}

TEST (DistanceMap, IsThereWithoutPixels)
{
  const Cloud::Ptr cloud = scene ();
  for (auto policy : {Estimator::BORDER_POLICY_IGNORE, Estimator::BORDER_POLICY_MIRROR})
  {
    Estimator estimator;
    estimator.setNormalEstimationMethod (Estimator::SIMPLE_3D_GRADIENT);
    estimator.setBorderPolicy (policy);
    estimator.setInputCloud (cloud);
    estimator.setIndices (pcl::IndicesPtr (new pcl::Indices));
    Normals normals;
    estimator.compute (normals);
    EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
    ASSERT_NE (estimator.getDistanceMap (), nullptr);
    EXPECT_EQ (estimator.getDistanceMap ()[22 * 60 + 50], 6.0f);
  }
}

TEST (PointNormal, UsesTheRectangleAndComputeDoesNot)
{
  for (auto method : {Estimator::COVARIANCE_MATRIX, Estimator::AVERAGE_3D_GRADIENT, Estimator::AVERAGE_DEPTH_CHANGE,
                      Estimator::SIMPLE_3D_GRADIENT})
  {
    Estimator estimator;
    estimator.setNormalEstimationMethod (method);
    estimator.setInputCloud (scene ());
    pcl::Normal normal;
    estimator.computePointNormal (25, 15, 15 * 60 + 25, normal);
    EXPECT_TRUE (std::isnan (normal.normal_x)) << "the rectangle is 0 x 0 at first";
    estimator.setRectSize (10, 10);
    estimator.computePointNormal (25, 15, 15 * 60 + 25, normal);
    EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
    const Normals whole = computeFresh (scene (), method);
    const float cosine = normal.getNormalVector3fMap ().dot (whole[15 * 60 + 25].getNormalVector3fMap ());
    EXPECT_NEAR (cosine, 1.0f, 1e-6f); // compute may sum in another order
    estimator.setRectSize (9, 4);
    EXPECT_TRUE (areEqual (compute (estimator), whole));
    pcl::Normal other;
    estimator.computePointNormal (25, 15, 15 * 60 + 25, other);
    EXPECT_FALSE (areSame (normal, other)) << "compute has left the rectangle alone";
    EXPECT_TRUE (areSame (other, chosenWindow (method, 25, 15, 9, 4))) << "width and height";
    EXPECT_FALSE (areSame (other, chosenWindow (method, 25, 15, 4, 9)));
    if (method != Estimator::SIMPLE_3D_GRADIENT)
    {
      estimator.computePointNormalMirror (0, 0, 0, other);
      EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
    }
    estimator.computePointNormal (-1, 0, 0, other);
    EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_INDEX);
    EXPECT_TRUE (std::isnan (other.normal_x) && std::isnan (other.curvature));
    estimator.setRectSize (-5, 5);
    estimator.computePointNormal (25, 15, 15 * 60 + 25, other);
    EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_OPTION_VALUE);
  }
}

TEST (Copies, AreIndependentAndEqual)
{
  Estimator original;
  original.setNormalEstimationMethod (Estimator::COVARIANCE_MATRIX);
  original.setNormalSmoothingSize (6.0f);
  original.setInputCloud (scene ());
  const Normals expected = compute (original);
  ASSERT_NE (original.getDistanceMap (), nullptr);
  Estimator copy (original);
  EXPECT_NE (copy.getDistanceMap (), original.getDistanceMap ());
  EXPECT_TRUE (areEqual (compute (copy), expected));
  copy.setInputCloud (scene (30, 70));
  EXPECT_EQ (compute (copy).size (), 2100u);
  EXPECT_TRUE (areEqual (compute (original), expected));
  copy = original;
  EXPECT_TRUE (areEqual (compute (copy), expected));
  const Estimator moved (std::move (copy)); // as a copy
  EXPECT_TRUE (areEqual (compute (copy), expected));
  original = std::move (moved);
  EXPECT_TRUE (areEqual (compute (original), expected));
}

TEST (Copies, WorkInThreadsAtTheSameTime)
{
  Estimator original;
  original.setInputCloud (scene ());
  const Normals expected = compute (original);
  std::vector<Estimator> estimators (4, original);
  // Every second one with a cloud of another size: the copies' lists of indices are their own.
  const Normals expected_of_other = computeFresh (scene (30, 70), Estimator::AVERAGE_3D_GRADIENT);
  for (std::size_t i = 1; i < estimators.size (); i += 2)
    estimators[i].setInputCloud (scene (30, 70));
  std::vector<Normals> results (estimators.size ());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < estimators.size (); ++i)
    threads.emplace_back ([&, i] () { estimators[i].compute (results[i]); });
  for (auto &thread : threads)
    thread.join ();
  for (std::size_t i = 0; i < results.size (); ++i)
    EXPECT_TRUE (areEqual (results[i], i % 2 == 0 ? expected : expected_of_other)) << i;
}

TEST (Threads, DoNotChangeTheResult)
{
  // Before there are any others, which might be listed still.
  const std::size_t before = countThreads ();
  for (auto method : {Estimator::COVARIANCE_MATRIX, Estimator::AVERAGE_3D_GRADIENT, Estimator::AVERAGE_DEPTH_CHANGE})
  {
    const Normals expected = computeFresh (scene (), method);
    for (unsigned threads : {0u, 1u, 2u, 3u, 7u})
    {
      Estimator estimator;
      estimator.setNormalEstimationMethod (method);
      estimator.setNumberOfThreads (threads);
      estimator.setInputCloud (scene ());
      EXPECT_TRUE (areEqual (compute (estimator), expected)) << threads;
    }
  }
  Estimator estimator;
  estimator.setNumberOfThreads (3);
  estimator.setInputCloud (scene ());
  compute (estimator);
  EXPECT_TRUE (hasThreads (before + 2)) << "the calling thread computes too";
  estimator.setNumberOfThreads (1);
  compute (estimator);
  EXPECT_TRUE (hasThreads (before));
  estimator.setNumberOfThreads (5000); // refused
  estimator.setInputCloud (scene ());
  EXPECT_TRUE (areEqual (compute (estimator), computeFresh (scene (), Estimator::AVERAGE_3D_GRADIENT)));
  EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
}

TEST (SearchTree, IsNeitherBuiltNorUsed)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  compute (estimator);
  EXPECT_EQ (estimator.getSearchMethod (), nullptr);
  EXPECT_EQ (estimator.getSearchSurface (), nullptr);
  EXPECT_EQ (estimator.getSearchParameter (), 1.0);
  estimator.setKSearch (0);
  estimator.setRadiusSearch (0.03);
  compute (estimator);
  EXPECT_EQ (estimator.getSearchParameter (), 0.03);
  const std::shared_ptr<WatchedTree> tree (new WatchedTree);
  estimator.setSearchMethod (tree);
  EXPECT_GT (countNormals (compute (estimator)), 100u);
  EXPECT_FALSE (tree->is_used);
  EXPECT_EQ (estimator.getSearchMethod (), tree);
}
