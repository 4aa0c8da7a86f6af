// Runs PCL's class and ours over one cloud in every configuration and compares them pixel by pixel.

#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <typeinfo>
#include <vector>

#include <gtest/gtest.h>

#include <pcl/features/integral_image_normal.h>
#include <pcl/point_types.h>

#include <iine/pcl/integral_image_normal.h>

#include "pcl_defined.h"
#include "reference.h"

namespace cross_check
{
  constexpr double ANGLE_TO_PCL = 0.01;        ///< degrees; larger ones are judged by the reference
  constexpr double ANGLE_TO_REFERENCE = 0.001; ///< degrees, COVARIANCE_MATRIX
  constexpr double CURVATURE_TO_REFERENCE = 1e-5;
  constexpr double FLOAT_ANGLE = 1e-5;         ///< degrees: rounding of a unit vector to f32
  constexpr double FLOAT_CURVATURE = 1e-7;     ///< the same of a curvature
  constexpr double EDGE_ON = 1e-6;             ///< cosine below which f32 does not decide which side is seen
  constexpr int REFERENCE_STEP = 7;            ///< COVARIANCE_MATRIX: the reference for every 7th normal

  constexpr const char *METHODS[] = {"COVARIANCE_MATRIX", "AVERAGE_3D_GRADIENT", "AVERAGE_DEPTH_CHANGE",
                                     "SIMPLE_3D_GRADIENT"};

  /** \brief One configuration of either class. */
  struct Config
  {
    int method;
    bool mirror;
    bool depth_dependent;
    float size;
    float factor;
    bool indices;

    std::string
    name () const
    {
      char text[120];
      std::snprintf (text, sizeof (text), "%-20s %-6s %-5s %3g %.2f %-7s", METHODS[method],
                     mirror ? "MIRROR" : "IGNORE", depth_dependent ? "depth" : "fixed", size, factor,
                     indices ? "indices" : "whole");
      return text;
    }
  };

  /** \brief Whether only a part of the configurations is run (IINE_CROSS_CHECK=quick), to save time. */
  inline bool
  isQuick ()
  {
    const char *const value = std::getenv ("IINE_CROSS_CHECK");
    return value != nullptr && std::string (value) == "quick";
  }

  inline std::vector<Config>
  configs ()
  {
    std::vector<Config> result;
    const std::vector<float> sizes = isQuick () ? std::vector<float> {5.0f, 20.0f}
                                                : std::vector<float> {3.0f, 5.0f, 7.0f, 7.5f, 10.0f, 20.0f, 40.0f};
    for (int method = 0; method < 4; ++method)
      for (bool mirror : {false, true})
        for (bool depth_dependent : {false, true})
          for (float size : sizes)
            for (float factor : {0.02f, 0.05f})
              for (bool indices : {false, true})
                result.push_back ({method, mirror, depth_dependent, size, factor, indices});
    return result;
  }

  /** \brief Sorted values and their percentiles. */
  class Distribution
  {
    public:
      void
      add (double value)
      {
        values_.push_back (value);
        is_sorted_ = false;
      }

      std::size_t size () const { return values_.size (); }

      /** \brief The smallest value that at least a part \a p of all values is not above; 0 of none. */
      double
      at (double p)
      {
        if (values_.empty ())
          return 0.0;
        if (!is_sorted_)
          std::sort (values_.begin (), values_.end ());
        is_sorted_ = true;
        const double rank = std::ceil (p * static_cast<double> (values_.size ()));
        return values_[static_cast<std::size_t> (std::max (rank, 1.0)) - 1];
      }

    private:
      std::vector<double> values_;
      bool is_sorted_ = false;
  };

  /** \brief What one configuration over one cloud comes to; one row of the report. */
  struct Row
  {
    std::size_t compared = 0;       ///< pixels where PCL is defined
    std::size_t normals = 0;        ///< of these, with a normal from both
    std::size_t mask_mismatches = 0;
    std::size_t undefined = 0;      ///< PCL would leave the image
    std::size_t off_by_one = 0;     ///< PCL's border test for indices
    std::size_t lines = 0;          ///< masks differ where the window spans no plane: PCL's is rounding
    std::size_t below_f32 = 0;      ///< only ours has a normal, and PCL's matrix is f32 rounding
    std::size_t edge_on = 0;        ///< the side seen is below f32's rounding
    std::size_t judged = 0;         ///< differences above 0.01 deg, all judged by the reference
    std::size_t worse = 0;          ///< of these, with PCL nearer the reference
    std::size_t turned = 0;         ///< normals that point away from the viewpoint
    std::size_t curvature_nan = 0;  ///< curvature NaN in one and not the other
    Distribution angle;             ///< ours to PCL's, degrees
    Distribution ours, pcls;        ///< to the reference, degrees (COVARIANCE_MATRIX)
    Distribution our_curvature, pcl_curvature;
  };

  inline double
  angle (const Eigen::Vector3d &a, const Eigen::Vector3d &b)
  {
    return std::atan2 (a.cross (b).norm (), a.dot (b)) * 180.0 / M_PI;
  }

  /** \brief The angle between two lines, at most 90. */
  inline double
  lineAngle (const Eigen::Vector3d &a, const Eigen::Vector3d &b)
  {
    return std::atan2 (a.cross (b).norm (), std::abs (a.dot (b))) * 180.0 / M_PI;
  }

  /** \brief Cosine between a normal and the direction from a point to the viewpoint; 0 where there is none. */
  inline double
  facing (const Eigen::Vector3d &normal, const Eigen::Vector3d &to_viewpoint)
  {
    const double length = to_viewpoint.norm ();
    return length > 0.0 && std::isfinite (length) ? normal.dot (to_viewpoint) / length : 0.0;
  }

  template <typename Estimator, typename Cloud> void
  prepare (Estimator &estimator, const Config &config, const typename Cloud::ConstPtr &cloud)
  {
    estimator.setNormalEstimationMethod (static_cast<typename Estimator::NormalEstimationMethod> (config.method));
    estimator.setBorderPolicy (static_cast<typename Estimator::BorderPolicy> (config.mirror ? 1 : 0));
    estimator.setDepthDependentSmoothing (config.depth_dependent);
    estimator.setNormalSmoothingSize (config.size);
    estimator.setMaxDepthChangeFactor (config.factor);
    estimator.setInputCloud (cloud);
  }

  /** \brief Both classes over one cloud. */
  template <typename PointT>
  class Comparison
  {
    public:
      using Cloud = pcl::PointCloud<PointT>;
      using Normals = pcl::PointCloud<pcl::Normal>;
      using Pcl = pcl::IntegralImageNormalEstimation<PointT, pcl::Normal>;
      using Ours = iine::IntegralImageNormalEstimation<PointT, pcl::Normal>;

      explicit Comparison (const typename Cloud::ConstPtr &cloud) : cloud_ (cloud)
      {
        static_assert (!std::is_same<Pcl, Ours>::value, "the two classes must be different ones");
        // Every fifth pixel in an order of its own, some of them twice.
        const std::size_t size = cloud->size ();
        for (std::size_t i = 0; i < size / 5 + 1; ++i)
          indices_.push_back (static_cast<int> (i * 7919 % size));
        our_listed_.setIndices (std::make_shared<pcl::Indices> (indices_));
      }

      Row
      run (const Config &config)
      {
        Row row;
        const int width = static_cast<int> (cloud_->width), height = static_cast<int> (cloud_->height);
        const pcl_defined::Setting setting {static_cast<reference::Method> (config.method), config.mirror, width,
                                            height};
        const int border = static_cast<int> (config.size);

        Ours &ours = config.indices ? our_listed_ : our_whole_;
        prepare<Ours, Cloud> (ours, config, cloud_);
        if (config.method == reference::SIMPLE_3D_GRADIENT && config.mirror)
        {
          checkThrow (ours, config);
          return row;
        }
        Normals our_normals;
        ours.compute (our_normals);
        EXPECT_EQ (ours.getLastStatus (), IINE_OK) << config.name ();
        const float *const distances = ours.getDistanceMap ();
        if (distances == nullptr)
        {
          ADD_FAILURE () << "no distance map: " << config.name ();
          return row;
        }

        // PCL is asked only for pixels where it is defined: for the whole cloud if that is all of them, else for
        // a list of indices.
        const auto isUndefined = [&] (int index)
        {
          const int x = index % width, y = index / width, side = windowSide (config, distances, index);
          return side > 0 && isTried (config, border, x, y) && !pcl_defined::isPixelDefined (setting, x, y, side);
        };
        const std::size_t count = our_normals.size ();
        const auto index = [&] (std::size_t k) { return config.indices ? indices_[k] : static_cast<int> (k); };
        for (std::size_t k = 0; k < count; ++k)
          row.undefined += isUndefined (index (k));
        const bool is_whole =
            !config.indices && pcl_defined::isBorderDefined (setting, border) && row.undefined == 0;
        std::vector<std::size_t> places;
        pcl::IndicesPtr asked (new pcl::Indices);
        for (std::size_t k = 0; k < count; ++k)
        {
          if (isUndefined (index (k)))
            continue;
          if (!is_whole && windowSide (config, distances, index (k)) > 0
              && pcl_defined::isBorderOffByOne (setting, border, index (k) % width, index (k) / width))
          {
            ++row.off_by_one;
            continue;
          }
          places.push_back (k);
          asked->push_back (index (k));
        }
        if (!pcl_defined::isImageDefined (setting))
        {
          row.undefined += asked->size ();
          return row;
        }
        if (asked->empty ())
          return row;
        // As many indices as pixels would take PCL's path for the whole cloud, which goes by pixels.
        if (!is_whole && asked->size () >= cloud_->size ())
          asked->resize (cloud_->size () - 1);

        pcl::console::setVerbosityLevel (pcl::console::L_ALWAYS); // PCL's search tree complains of most clouds
        Pcl pcl;
        prepare<Pcl, Cloud> (pcl, config, cloud_);
        if (!is_whole)
          pcl.setIndices (asked);
        Normals pcl_normals;
        pcl.compute (pcl_normals);
        checkClouds (config, our_normals, pcl_normals, is_whole);
        if (is_whole)
          checkDistances (config, distances, pcl.getDistanceMap ());

        for (std::size_t k = 0; k < asked->size (); ++k)
          comparePixel (config, row, our_normals[places[k]], pcl_normals[k], distances, (*asked)[k]);
        return row;
      }

    private:
      /** \brief Whether a pixel lies inside the ignored border, if there is one. */
      bool
      isTried (const Config &config, int border, int x, int y) const
      {
        const auto inside = [&] (int at, int size) { return at >= border && at < size - border; };
        return config.mirror
            || (inside (x, static_cast<int> (cloud_->width)) && inside (y, static_cast<int> (cloud_->height)));
      }

      int
      windowSide (const Config &config, const float *distances, int index) const
      {
        const float z = (*cloud_)[index].z;
        if (!std::isfinite (z))
          return 0;
        const float most = config.depth_dependent ? config.size + z / 10.0f : config.size;
        const float smoothing = std::min (distances[index], most);
        return smoothing > 2.0f ? static_cast<int> (smoothing) : 0;
      }

      void
      checkThrow (Ours &ours, const Config &config)
      {
        Normals normals;
        EXPECT_THROW (ours.compute (normals), pcl::PCLException) << config.name ();
        EXPECT_EQ (ours.getLastStatus (), IINE_ERROR_UNSUPPORTED);
        Pcl pcl;
        prepare<Pcl, Cloud> (pcl, config, cloud_);
        try
        {
          pcl.compute (normals); // throws at the first pixel with a window
          for (const auto &normal : normals)
            EXPECT_TRUE (std::isnan (normal.normal_x));
        }
        catch (const pcl::PCLException &)
        {
        }
      }

      void
      checkClouds (const Config &config, const Normals &ours, const Normals &pcls, bool is_whole)
      {
        EXPECT_EQ (ours.is_dense, pcls.is_dense) << config.name ();
        EXPECT_EQ (ours.header.seq, pcls.header.seq);
        EXPECT_EQ (ours.header.stamp, pcls.header.stamp);
        EXPECT_EQ (ours.header.frame_id, pcls.header.frame_id);
        EXPECT_EQ (ours.sensor_origin_, pcls.sensor_origin_);
        EXPECT_TRUE (ours.sensor_orientation_.coeffs () == pcls.sensor_orientation_.coeffs ());
        EXPECT_EQ (ours.size (), static_cast<std::size_t> (ours.width) * ours.height) << config.name ();
        if (is_whole)
        {
          EXPECT_EQ (ours.width, pcls.width) << config.name ();
          EXPECT_EQ (ours.height, pcls.height) << config.name ();
        }
      }

      void
      checkDistances (const Config &config, const float *ours, const float *pcls)
      {
        std::size_t different = 0;
        for (std::size_t i = 0; i < cloud_->size (); ++i)
          different += ours[i] != pcls[i];
        EXPECT_EQ (different, 0u) << "distance maps differ: " << config.name ();
      }

      void
      comparePixel (const Config &config, Row &row, const pcl::Normal &our, const pcl::Normal &pcl,
                    const float *distances, int index)
      {
        ++row.compared;
        const auto isNormal = [] (const pcl::Normal &n)
        { return std::isfinite (n.normal_x) && std::isfinite (n.normal_y) && std::isfinite (n.normal_z); };
        const auto estimate = [&] ()
        {
          const int width = static_cast<int> (cloud_->width);
          return reference::Pixel<Cloud> (*cloud_, config.mirror, index % width, index / width,
                                          windowSide (config, distances, index))
              .estimate (static_cast<reference::Method> (config.method));
        };
        const bool is_covariance = config.method == reference::COVARIANCE_MATRIX;
        row.curvature_nan += std::isnan (our.curvature) != std::isnan (pcl.curvature);
        if (isNormal (our) != isNormal (pcl))
        {
          const reference::Result truth = is_covariance ? estimate () : reference::Result ();
          if (truth.is_line)
            ++row.lines;
          else if (truth.is_below_f32 && isNormal (our))
            ++row.below_f32;
          else
          {
            ++row.mask_mismatches;
            if (row.mask_mismatches == 1)
              ADD_FAILURE () << "only " << (isNormal (our) ? "ours" : "PCL's") << " has a normal at pixel "
                             << index % cloud_->width << " " << index / cloud_->width << ": " << config.name ();
          }
          return;
        }
        if (!isNormal (our))
          return;
        ++row.normals;
        const Eigen::Vector3d our_normal = our.getNormalVector3fMap ().template cast<double> ();
        const Eigen::Vector3d pcl_normal = pcl.getNormalVector3fMap ().template cast<double> ();
        const Eigen::Vector3d to_viewpoint =
            cloud_->sensor_origin_.template head<3> ().template cast<double> ()
            - (*cloud_)[index].getVector3fMap ().template cast<double> ();
        const double our_facing = facing (our_normal, to_viewpoint);
        const bool is_edge_on = std::abs (our_facing) <= EDGE_ON;
        row.edge_on += is_edge_on;
        row.turned += our_facing < -EDGE_ON;

        const double difference = is_edge_on ? lineAngle (our_normal, pcl_normal) : angle (our_normal, pcl_normal);
        row.angle.add (difference);
        if (is_covariance)
        {
          if (row.normals % REFERENCE_STEP != 0)
            return;
          const reference::Result truth = estimate ();
          if (truth.is_plane_defined)
          {
            row.ours.add (lineAngle (our_normal, truth.normal));
            row.pcls.add (lineAngle (pcl_normal, truth.normal));
          }
          if (!truth.is_line)
          {
            row.our_curvature.add (std::abs (our.curvature - truth.curvature));
            row.pcl_curvature.add (std::abs (pcl.curvature - truth.curvature));
          }
        }
        else if (difference > ANGLE_TO_PCL)
        {
          ++row.judged;
          Eigen::Vector3d truth = estimate ().normal;
          const double side = facing (truth, to_viewpoint);
          if (side < 0.0)
            truth = -truth;
          const bool is_undecided = is_edge_on || std::abs (side) <= EDGE_ON;
          const double our_error = is_undecided ? lineAngle (our_normal, truth) : angle (our_normal, truth);
          const double pcl_error = is_undecided ? lineAngle (pcl_normal, truth) : angle (pcl_normal, truth);
          if (!(our_error <= pcl_error))
          {
            ++row.worse;
            ADD_FAILURE () << "PCL's is nearer the reference (" << pcl_error << " against " << our_error
                           << " deg) at pixel " << index % cloud_->width << " " << index / cloud_->width << ": "
                           << config.name ();
          }
        }
      }

      typename Cloud::ConstPtr cloud_;
      pcl::Indices indices_;
      // One object for all configurations, as callers have it; PCL's does not survive that.
      Ours our_whole_;
      Ours our_listed_;
  };

  /** \brief The bounds that a row must keep. */
  inline void
  check (Row &row, const Config &config, bool is_frame)
  {
    EXPECT_EQ (row.mask_mismatches, 0u) << config.name ();
    EXPECT_EQ (row.worse, 0u) << config.name ();
    EXPECT_EQ (row.turned, 0u) << config.name ();
    EXPECT_EQ (row.curvature_nan, 0u) << config.name ();
    if (config.method != reference::COVARIANCE_MATRIX)
    {
      if (is_frame)
      {
        EXPECT_LE (row.angle.at (0.999), ANGLE_TO_PCL) << config.name ();
      }
      return;
    }
    EXPECT_LE (row.ours.at (0.999), ANGLE_TO_REFERENCE) << config.name ();
    EXPECT_LE (row.our_curvature.at (0.999), CURVATURE_TO_REFERENCE) << config.name ();
    for (double p : {0.5, 0.99, 1.0})
    {
      EXPECT_LE (row.ours.at (p), std::max (row.pcls.at (p), FLOAT_ANGLE)) << p << " " << config.name ();
      EXPECT_LE (row.our_curvature.at (p), std::max (row.pcl_curvature.at (p), FLOAT_CURVATURE))
          << p << " " << config.name ();
    }
  }

  /** \brief The report: a file in the directory that IINE_REPORT names, else in the current one, and a summary per
    * method printed at the end. */
  class Report
  {
    public:
      explicit Report (const std::string &name) : name_ (name)
      {
        const char *const directory = std::getenv ("IINE_REPORT");
        std::string file = name;
        std::replace_if (file.begin (), file.end (), [] (char c) { return !std::isalnum (c) && c != '_'; }, '_');
        const std::string path = std::string (directory != nullptr ? directory : ".") + "/cross_check_" + file + ".txt";
        file_ = std::fopen (path.c_str (), "w");
        EXPECT_NE (file_, nullptr) << path;
        if (file_ == nullptr)
          return;
        std::fprintf (file_,
                      "# %s\n# angles in degrees; ref: COVARIANCE_MATRIX against the f64 reference at every %dth normal\n"
                      "%-31s%-55s %8s %8s %5s %6s %6s %5s %5s %7s %6s %5s | %9s %9s %9s %9s | %9s %9s | %9s %9s %9s %9s | "
                      "%9s %9s\n",
                      name.c_str (), REFERENCE_STEP, "cloud", "configuration", "compared", "normals", "mask",
                      "undef", "off1", "line", "f32", "edge-on", "judged", "worse", "p50", "p99", "p99.9", "max",
                      "ours p99.9", "ours max", "PCL p50", "PCL p99", "PCL p99.9", "PCL max", "ours curv", "PCL curv");
      }

      ~Report ()
      {
        if (file_ != nullptr)
          std::fclose (file_);
        std::printf ("%-30s %10s %10s %6s %8s %7s %7s %7s %8s %8s | worst p99.9 and max of ours to PCL's (deg)\n",
                     name_.c_str (), "compared", "normals", "mask", "undef", "line", "f32", "judged", "worse", "off1");
        for (int method = 0; method < 4; ++method)
        {
          const Sum &s = sums_[method];
          EXPECT_GT (s.normals, 0u) << name_ << ", " << METHODS[method];
          std::printf ("%-30s %10zu %10zu %6zu %8zu %7zu %7zu %7zu %8zu %8zu | %.6f %.6f", METHODS[method], s.compared,
                       s.normals, s.mask, s.undefined, s.lines, s.below_f32, s.judged, s.worse, s.off_by_one, s.p999, s.max);
          if (method == reference::COVARIANCE_MATRIX)
            std::printf (" | to f64: ours %.7f %.6f, PCL's %.4f %.3f, curvature ours %.1e, PCL's %.1e", s.ours_p999,
                         s.ours_max, s.pcls_p999, s.pcls_max, s.our_curvature, s.pcl_curvature);
          std::printf ("\n");
        }
      }

      Report (const Report &) = delete;
      Report &operator= (const Report &) = delete;

      void
      add (const std::string &cloud, const Config &config, Row &r)
      {
        Sum &s = sums_[config.method];
        s.compared += r.compared;
        s.normals += r.normals;
        s.mask += r.mask_mismatches;
        s.undefined += r.undefined;
        s.off_by_one += r.off_by_one;
        s.lines += r.lines;
        s.below_f32 += r.below_f32;
        s.judged += r.judged;
        s.worse += r.worse;
        s.p999 = std::max (s.p999, r.angle.at (0.999));
        s.max = std::max (s.max, r.angle.at (1.0));
        s.ours_p999 = std::max (s.ours_p999, r.ours.at (0.999));
        s.ours_max = std::max (s.ours_max, r.ours.at (1.0));
        s.pcls_p999 = std::max (s.pcls_p999, r.pcls.at (0.999));
        s.pcls_max = std::max (s.pcls_max, r.pcls.at (1.0));
        s.our_curvature = std::max (s.our_curvature, r.our_curvature.at (1.0));
        s.pcl_curvature = std::max (s.pcl_curvature, r.pcl_curvature.at (1.0));
        if (file_ != nullptr)
          std::fprintf (file_,
                        "%-31s%-55s %8zu %8zu %5zu %6zu %6zu %5zu %5zu %7zu %6zu %5zu | %9.6f %9.6f %9.6f %9.5f | %9.7f "
                        "%9.7f | %9.5f %9.5f %9.4f %9.4f | %9.1e %9.1e\n",
                        cloud.c_str (), config.name ().c_str (), r.compared, r.normals, r.mask_mismatches, r.undefined,
                        r.off_by_one, r.lines, r.below_f32, r.edge_on, r.judged, r.worse, r.angle.at (0.5), r.angle.at (0.99),
                        r.angle.at (0.999), r.angle.at (1.0), r.ours.at (0.999), r.ours.at (1.0), r.pcls.at (0.5),
                        r.pcls.at (0.99), r.pcls.at (0.999), r.pcls.at (1.0), r.our_curvature.at (1.0),
                        r.pcl_curvature.at (1.0));
      }

    private:
      struct Sum
      {
        std::size_t compared = 0, normals = 0, mask = 0, undefined = 0, off_by_one = 0, lines = 0, below_f32 = 0, judged = 0,
                    worse = 0;
        double p999 = 0, max = 0, ours_p999 = 0, ours_max = 0, pcls_p999 = 0, pcls_max = 0, our_curvature = 0,
               pcl_curvature = 0;
      };

      std::string name_;
      std::FILE *file_ = nullptr;
      Sum sums_[4];
  };
}
