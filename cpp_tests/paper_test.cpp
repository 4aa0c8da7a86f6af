// What PCL's class does not have: the paper's semantics, one-sided and crease windows, missing zeros, maps. All are
// the C API's, bit for bit, and off by default.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "point_xyz.h"

namespace
{
  /** \brief Two walls that meet, a step in depth, a missing block and a block of zeros. */
  Cloud::Ptr
  scene (int width = 60, int height = 44)
  {
    Cloud::Ptr cloud (new Cloud (width, height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
      {
        const float u = static_cast<float> (x - width / 2) / 120.0f, v = static_cast<float> (y - height / 2) / 120.0f;
        const float z = 1.5f / (1.0f + std::fabs (u)) + (y > 30 ? 0.5f : 0.0f) + 0.001f * std::sin (40.0f * v);
        auto &point = (*cloud) (x, y);
        point.x = u * z;
        point.y = v * z;
        point.z = x > 40 && x < 44 && y > 20 && y < 24 ? NaN : z;
        if (x > 10 && x < 20 && y > 10 && y < 20)
          point.x = point.y = point.z = 0.0f;
      }
    return cloud;
  }

  /** \brief An estimator of the C API, with the cloud and results as the class has them. */
  class Reference
  {
    public:
      explicit Reference (const Cloud &cloud)
      {
        EXPECT_EQ (iine_estimator_new (&estimator), IINE_OK);
        points.struct_size = sizeof (points);
        points.width = cloud.width;
        points.height = cloud.height;
        points.x = &cloud[0].x;
        points.y = &cloud[0].y;
        points.z = &cloud[0].z;
        points.point_stride = sizeof (pcl::PointXYZ);
        size = cloud.size ();
      }

      Reference (const Reference &) = delete;
      Reference &
      operator= (const Reference &) = delete;

      ~Reference ()
      {
        iine_estimator_free (estimator);
      }

      Normals
      normals ()
      {
        Normals computed (points.width, points.height);
        iine_normals to = {};
        to.struct_size = sizeof (to);
        to.nx = &computed[0].normal_x;
        to.ny = &computed[0].normal_y;
        to.nz = &computed[0].normal_z;
        to.curvature = &computed[0].curvature;
        to.point_stride = to.curvature_point_stride = sizeof (pcl::Normal);
        EXPECT_EQ (iine_estimator_compute (estimator, &points, &to), IINE_OK);
        return computed;
      }

      template <typename Value> std::vector<Value>
      map (Value *iine_maps::*field, std::size_t values_per_pixel)
      {
        std::vector<Value> computed (size * values_per_pixel);
        iine_maps maps = {};
        maps.struct_size = sizeof (maps);
        maps.*field = computed.data ();
        EXPECT_EQ (iine_estimator_compute_maps (estimator, &points, &maps), IINE_OK);
        return computed;
      }

      iine_estimator *estimator = nullptr;

    private:
      iine_points points = {};
      std::size_t size = 0;
  };

  bool
  haveSameBits (const Normals &a, const Normals &b)
  {
    if (a.size () != b.size ())
      return false;
    for (std::size_t i = 0; i < a.size (); ++i)
      if (std::memcmp (a[i].normal, b[i].normal, 3 * sizeof (float)) != 0
          || std::memcmp (&a[i].curvature, &b[i].curvature, sizeof (float)) != 0)
        return false;
    return true;
  }

  template <typename Value> bool
  haveSameBits (const std::vector<Value> &a, const std::vector<Value> &b)
  {
    return a.size () == b.size () && std::memcmp (a.data (), b.data (), a.size () * sizeof (Value)) == 0;
  }

  /** \brief A setting by the class and by the C API. */
  struct Setting
  {
    std::string name;
    std::function<void (Estimator &)> set;
    std::function<int (iine_estimator *)> set_c;
  };

  const std::vector<Setting> settings = {
    {"nothing", [] (Estimator &) {}, [] (iine_estimator *) { return 0; }},
    {"alpha", [] (Estimator &e) { e.setPaperAlpha (0.009f); },
     [] (iine_estimator *e) { return iine_estimator_set_paper_alpha (e, 0.009f); }},
    {"beta", [] (Estimator &e) { e.setPaperBeta (1300.0f); },
     [] (iine_estimator *e) { return iine_estimator_set_paper_beta (e, 1300.0f); }},
    {"gamma", [] (Estimator &e) { e.setPaperGamma (100.0f); },
     [] (iine_estimator *e) { return iine_estimator_set_paper_gamma (e, 100.0f); }},
    {"radii", [] (Estimator &e) { e.setPaperRadii (1, 3, 4); },
     [] (iine_estimator *e) { return iine_estimator_set_paper_radii (e, 1, 3, 4); }},
    {"metric", [] (Estimator &e) { e.setPaperDistanceMetric (Estimator::DISTANCE_METRIC_CHAMFER); },
     [] (iine_estimator *e) {
       return iine_estimator_set_paper_distance_metric (e, IINE_DISTANCE_METRIC_CHAMFER);
     }},
    {"depth", [] (Estimator &e) { e.setPaperDepth (Estimator::DEPTH_RANGE); },
     [] (iine_estimator *e) { return iine_estimator_set_paper_depth (e, IINE_DEPTH_RANGE); }},
    {"zero is missing", [] (Estimator &e) { e.setZeroIsMissing (true); },
     [] (iine_estimator *e) { return iine_estimator_set_zero_is_missing (e, 1); }},
    {"one-sided windows", [] (Estimator &e) { e.setOneSidedWindows (true); },
     [] (iine_estimator *e) { return iine_estimator_set_one_sided_windows (e, 1); }},
    {"crease windows", [] (Estimator &e) { e.setCreaseWindows (true); },
     [] (iine_estimator *e) { return iine_estimator_set_crease_windows (e, 1); }},
  };
}

TEST (Paper, EverySettingIsTheCApis)
{
  const Cloud::Ptr cloud = scene ();
  const Estimator::NormalEstimationMethod methods[] = {
      Estimator::COVARIANCE_MATRIX, Estimator::AVERAGE_3D_GRADIENT, Estimator::AVERAGE_DEPTH_CHANGE};
  for (const auto method : methods)
    for (const auto semantics : {Estimator::SEMANTICS_PCL, Estimator::SEMANTICS_PAPER})
    {
      Normals without;
      std::vector<float> areas_without;
      for (const Setting &setting : settings)
      {
        SCOPED_TRACE (setting.name + ", method " + std::to_string (method) + ", semantics "
                      + std::to_string (semantics));
        Estimator estimator;
        estimator.setInputCloud (cloud);
        estimator.setNormalEstimationMethod (method);
        estimator.setSemantics (semantics);
        setting.set (estimator);
        const Normals normals = compute (estimator);
        EXPECT_EQ (estimator.getLastStatus (), IINE_OK);

        Reference reference (*cloud);
        EXPECT_EQ (iine_estimator_set_method (reference.estimator, method), IINE_OK);
        EXPECT_EQ (iine_estimator_set_semantics (reference.estimator, semantics), IINE_OK);
        EXPECT_EQ (setting.set_c (reference.estimator), IINE_OK);
        EXPECT_TRUE (haveSameBits (normals, reference.normals ()));
        EXPECT_GT (countNormals (normals), 200u);

        std::vector<float> areas, radii, eigenvalues;
        std::vector<std::uint8_t> changes;
        ASSERT_TRUE (estimator.getSmoothingAreaMap (areas));
        ASSERT_TRUE (estimator.getDepthChangeMap (changes));
        EXPECT_TRUE (haveSameBits (areas, reference.map (&iine_maps::smoothing_areas, 1)));
        EXPECT_TRUE (haveSameBits (changes, reference.map (&iine_maps::depth_changes, 1)));
        const float *distances = estimator.getDistanceMap ();
        ASSERT_NE (distances, nullptr);
        EXPECT_TRUE (haveSameBits (std::vector<float> (distances, distances + cloud->size ()),
                                   reference.map (&iine_maps::distances, 1)));
        if (semantics == Estimator::SEMANTICS_PAPER)
        {
          ASSERT_TRUE (estimator.getDepthRadiusMap (radii));
          EXPECT_TRUE (haveSameBits (radii, reference.map (&iine_maps::depth_radii, 1)));
        }
        if (method == Estimator::COVARIANCE_MATRIX)
        {
          ASSERT_TRUE (estimator.getEigenvalueMap (eigenvalues));
          EXPECT_TRUE (haveSameBits (eigenvalues, reference.map (&iine_maps::eigenvalues, 3)));
        }

        // And each does something, where it should.
        if (setting.name == "nothing")
        {
          without = normals;
          areas_without = areas;
        }
        else if (semantics == Estimator::SEMANTICS_PAPER)
          EXPECT_FALSE (haveSameBits (normals, without) && haveSameBits (areas, areas_without));
        else
        {
          const bool is_of_paper = setting.name != "zero is missing" && setting.name != "one-sided windows"
              && setting.name != "crease windows";
          EXPECT_EQ (haveSameBits (normals, without) && haveSameBits (areas, areas_without), is_of_paper);
        }
      }
    }
}

TEST (Paper, DefaultIsPcl)
{
  Estimator by_default, set;
  for (Estimator *estimator : {&by_default, &set})
    estimator->setInputCloud (scene ());
  set.setSemantics (Estimator::SEMANTICS_PAPER);
  const Normals paper = compute (set);
  set.setSemantics (Estimator::SEMANTICS_PCL);
  const Normals normals = compute (by_default);
  EXPECT_TRUE (haveSameBits (normals, compute (set)));
  EXPECT_FALSE (haveSameBits (normals, paper));
  EXPECT_GT (countNormals (paper), countNormals (normals)); // the border of the image
}

TEST (Paper, RefusedParametersLeaveTheOldOnes)
{
  Estimator estimator, fresh;
  for (Estimator *e : {&estimator, &fresh})
  {
    e->setInputCloud (scene ());
    e->setSemantics (Estimator::SEMANTICS_PAPER);
    e->setPaperAlpha (0.004f);
    e->setPaperBeta (700.0f);
    e->setPaperGamma (4.0f);
    e->setPaperRadii (1, 4, 9);
  }
  for (float bad : {0.0f, -3.0f, NaN, std::numeric_limits<float>::infinity ()})
  {
    estimator.setPaperAlpha (bad);
    estimator.setPaperBeta (bad);
    estimator.setPaperGamma (bad);
  }
  estimator.setPaperRadii (0, 4, 9);
  estimator.setPaperRadii (5, 4, 9);
  estimator.setPaperRadii (1, 10, 9);
  estimator.setPaperRadii (1, 4, 1001);
  EXPECT_TRUE (haveSameBits (compute (estimator), compute (fresh)));
  EXPECT_EQ (estimator.getLastStatus (), IINE_OK);
}

TEST (Paper, WhatCannotBeComputedGivesNoNormalsAndAStatus)
{
  Estimator estimator;
  estimator.setInputCloud (scene ());
  estimator.setSemantics (Estimator::SEMANTICS_PAPER);
  estimator.setNormalEstimationMethod (Estimator::SIMPLE_3D_GRADIENT);
  std::vector<float> map (1);
  for (const auto policy : {Estimator::BORDER_POLICY_IGNORE, Estimator::BORDER_POLICY_MIRROR})
  {
    estimator.setBorderPolicy (policy);
    const Normals normals = compute (estimator);
    EXPECT_EQ (normals.size (), estimator.getInputCloud ()->size ());
    EXPECT_EQ (countNormals (normals), 0u);
    EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_UNSUPPORTED);
    EXPECT_EQ (estimator.getDistanceMap (), nullptr);
    map.assign (1, 0.0f);
    EXPECT_FALSE (estimator.getSmoothingAreaMap (map));
    EXPECT_TRUE (map.empty ());
  }
  estimator.setNormalEstimationMethod (Estimator::COVARIANCE_MATRIX);
  estimator.setSemantics (static_cast<Estimator::Semantics> (2));
  EXPECT_EQ (countNormals (compute (estimator)), 0u);
  EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_OPTION_VALUE);
  estimator.setSemantics (Estimator::SEMANTICS_PAPER);
  estimator.setPaperDepth (static_cast<Estimator::Depth> (-1));
  EXPECT_EQ (countNormals (compute (estimator)), 0u);
  EXPECT_EQ (estimator.getLastStatus (), IINE_ERROR_OPTION_VALUE);
  estimator.setPaperDepth (Estimator::DEPTH_Z);
  EXPECT_GT (countNormals (compute (estimator)), 1000u);
}

TEST (Maps, AreThoseOfTheLastCompute)
{
  Estimator estimator;
  std::vector<float> map, later;
  EXPECT_FALSE (estimator.getSmoothingAreaMap (map)); // no compute
  estimator.setInputCloud (scene ());
  EXPECT_FALSE (estimator.getSmoothingAreaMap (map));
  estimator.setSemantics (Estimator::SEMANTICS_PAPER);
  compute (estimator);
  EXPECT_TRUE (estimator.getSmoothingAreaMap (map));
  EXPECT_FALSE (estimator.getEigenvalueMap (later)); // not with this method
  EXPECT_TRUE (later.empty ());

  estimator.setSemantics (Estimator::SEMANTICS_PCL); // not computed yet
  estimator.setPaperGamma (0.1f);
  pcl::Normal normal;
  estimator.setRectSize (5, 5);
  estimator.computePointNormal (20, 20, 20 * 60 + 20, normal);
  EXPECT_TRUE (estimator.getSmoothingAreaMap (later));
  EXPECT_TRUE (haveSameBits (map, later));
  Estimator copy = estimator;
  EXPECT_TRUE (copy.getSmoothingAreaMap (later));
  EXPECT_TRUE (haveSameBits (map, later));

  compute (estimator);
  EXPECT_TRUE (estimator.getSmoothingAreaMap (later));
  EXPECT_FALSE (haveSameBits (map, later));
  EXPECT_FALSE (estimator.getDepthRadiusMap (later)); // not with PCL's semantics
  estimator.setInputCloud (scene (44, 33));
  EXPECT_FALSE (estimator.getSmoothingAreaMap (later));
}

TEST (Paper, AlphaOfASensor)
{
  EXPECT_FLOAT_EQ (Estimator::alphaOfSensor (0.125f, 580.0f, 0.075f), 0.125f / (580.0f * 0.075f));
}
