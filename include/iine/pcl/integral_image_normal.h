/*
 * SPDX-License-Identifier: BSD-3-Clause
 *
 * iine::IntegralImageNormalEstimation: the interface of pcl::IntegralImageNormalEstimation over libiine.
 */

#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <iine/iine.h>

#include <pcl/console/print.h>
#include <pcl/exceptions.h>
#include <pcl/features/feature.h>
#include <pcl/memory.h>
#include <pcl/pcl_macros.h>
#include <pcl/point_cloud.h>

namespace iine
{
  /** \brief Surface normals of organized point clouds by integral images.
    *
    * Takes the place of pcl::IntegralImageNormalEstimation: the same public members, defaults and results. All
    * computation is libiine's; this class hands it the clouds' own memory, in and out.
    *
    * What PCL's class does not have is off by default: \ref setSemantics follows the paper instead of PCL,
    * \ref setOneSidedWindows and \ref setCreaseWindows improve both near edges.
    *
    * What differs from PCL's class:
    * - the cloud is read when compute is called, not when it is set;
    * - output k belongs to indices[k] whatever the indices are, and equals what the whole cloud gives there;
    * - results are defined where PCL reads or writes out of bounds (see docs/pcl-compatibility.md);
    * - objects can be copied and reused for clouds of any size;
    * - no search tree is built, and the search parameters of the base class have no effect.
    *
    * One object is used by one thread at a time; different objects freely.
    *
    * \tparam PointInT a point type with float x, y, z
    * \tparam PointOutT a point type with float normal_x, normal_y, normal_z, curvature; its other fields stay as
    * they are. The output may be the input cloud itself, but not with indices, to which it is cut before it is read.
    */
  template <typename PointInT, typename PointOutT>
  class IntegralImageNormalEstimation : public pcl::Feature<PointInT, PointOutT>
  {
    protected:
      using pcl::Feature<PointInT, PointOutT>::fake_indices_;
      using pcl::Feature<PointInT, PointOutT>::feature_name_;
      using pcl::Feature<PointInT, PointOutT>::indices_;
      using pcl::Feature<PointInT, PointOutT>::input_;
      using pcl::Feature<PointInT, PointOutT>::k_;
      using pcl::Feature<PointInT, PointOutT>::search_parameter_;
      using pcl::Feature<PointInT, PointOutT>::search_radius_;

    public:
      using Ptr = pcl::shared_ptr<IntegralImageNormalEstimation<PointInT, PointOutT> >;
      using ConstPtr = pcl::shared_ptr<const IntegralImageNormalEstimation<PointInT, PointOutT> >;

      /** \brief What happens where a window would cross the border of the image. */
      enum BorderPolicy
      {
        BORDER_POLICY_IGNORE, ///< without one-sided windows the outer int(smoothing size) rows and columns get no normal
        BORDER_POLICY_MIRROR  ///< windows are folded back at the border
      };

      /** \brief How a normal is computed from the points in a pixel's window. */
      enum NormalEstimationMethod
      {
        COVARIANCE_MATRIX,    ///< eigenvector of the smallest eigenvalue of the covariance matrix; gives a curvature
        AVERAGE_3D_GRADIENT,  ///< cross product of the mean 3-D gradients
        AVERAGE_DEPTH_CHANGE, ///< cross product of smoothed depth changes
        SIMPLE_3D_GRADIENT    ///< cross product of the differences of the outermost strips; not with MIRROR or SEMANTICS_PAPER
      };

      /** \brief Whose definition of the windows and sums is followed. Not in PCL's class. */
      enum Semantics
      {
        SEMANTICS_PCL,  ///< PCL's class, step by step
        SEMANTICS_PAPER ///< the paper as published (docs/paper.md); not with SIMPLE_3D_GRADIENT
      };

      /** \brief How the distance to the nearest depth change is measured with SEMANTICS_PAPER. Not in PCL's class. */
      enum DistanceMetric
      {
        DISTANCE_METRIC_EUCLIDEAN, ///< exact
        DISTANCE_METRIC_CHAMFER    ///< Borgefors' 3-4 chamfer distance, at most 6 % off
      };

      /** \brief What a point's depth is with SEMANTICS_PAPER. Not in PCL's class. */
      enum Depth
      {
        DEPTH_Z,    ///< z, for cameras
        DEPTH_RANGE ///< the distance from the origin, for spinning LiDARs
      };

      using PointCloudIn = typename pcl::Feature<PointInT, PointOutT>::PointCloudIn;
      using PointCloudOut = typename pcl::Feature<PointInT, PointOutT>::PointCloudOut;

      /** \brief Constructor: AVERAGE_3D_GRADIENT, BORDER_POLICY_IGNORE, smoothing size 10, factor 0.02. */
      IntegralImageNormalEstimation ()
      {
        feature_name_ = "IntegralImagesNormalEstimation";
        k_ = 1;
      }

      /** \brief Copy constructor: the copy has the same options, cloud, indices and results. */
      IntegralImageNormalEstimation (const IntegralImageNormalEstimation &) = default;

      /** \brief Copy assignment. */
      IntegralImageNormalEstimation &
      operator= (const IntegralImageNormalEstimation &) = default;

      /** \brief Destructor. */
      ~IntegralImageNormalEstimation () override = default;

      /** \brief Set the window of \ref computePointNormal and \ref computePointNormalMirror. It has no effect on
        * compute, which chooses a window for every pixel; nor does compute change it.
        * \param[in] width the width in pixels, 0 or above; default 0, which gives NaN. These two refuse less: NaN,
        * a printed error and a status
        * \param[in] height the height in pixels, likewise
        */
      void
      setRectSize (const int width, const int height)
      {
        rect_width_ = width;
        rect_height_ = height;
      }

      /** \brief Set what happens where a window would cross the border of the image.
        * \param[in] border_policy the border policy
        */
      void
      setBorderPolicy (const BorderPolicy border_policy)
      {
        options_.border_policy = border_policy;
      }

      /** \brief Compute the normal of one pixel over the window of \ref setRectSize; what lies outside the image is
        * left out. Depth changes are not looked at.
        * \param[in] pos_x the pixel's column
        * \param[in] pos_y the pixel's row
        * \param[in] point_index the pixel's index, pos_y * width + pos_x (not used)
        * \param[out] normal the normal and the curvature, NaN if there is none
        */
      void
      computePointNormal (const int pos_x, const int pos_y, const unsigned point_index, PointOutT &normal)
      {
        static_cast<void> (point_index);
        computeWindow ("computePointNormal", BORDER_POLICY_IGNORE, pos_x, pos_y, normal);
      }

      /** \brief As \ref computePointNormal, with the window folded back at the border of the image.
        * \param[in] pos_x the pixel's column
        * \param[in] pos_y the pixel's row
        * \param[in] point_index the pixel's index, pos_y * width + pos_x (not used)
        * \param[out] normal the normal and the curvature, NaN if there is none
        * \throws pcl::PCLException for SIMPLE_3D_GRADIENT with SEMANTICS_PCL
        */
      void
      computePointNormalMirror (const int pos_x, const int pos_y, const unsigned point_index, PointOutT &normal)
      {
        static_cast<void> (point_index);
        computeWindow ("computePointNormalMirror", BORDER_POLICY_MIRROR, pos_x, pos_y, normal);
      }

      /** \brief Set the factor f of the depth change threshold: neighbours whose z differ by more than
        * 2 f (|z| + 1), z being that of the left or upper one, or of which one's z is not finite, are on different
        * surfaces.
        * \param[in] max_depth_change_factor the factor; the 1 is one of the cloud's unit
        */
      void
      setMaxDepthChangeFactor (float max_depth_change_factor)
      {
        options_.max_depth_change_factor = max_depth_change_factor;
      }

      /** \brief Set the side of the largest window without depth-dependent smoothing. A pixel's window has the side
        * min (distance to the nearest depth change, this), rounded down; where that minimum is not above 2 there is no
        * normal. \ref setDepthDependentSmoothing adds to the size; without it, sizes up to 2 give no normals but those of
        * \ref setOneSidedWindows.
        * \param[in] normal_smoothing_size the side in pixels, finite and above 0; anything else is refused with a
        * printed error
        */
      void
      setNormalSmoothingSize (float normal_smoothing_size)
      {
        const int status = iine_estimator_set_normal_smoothing_size (handle_.get (), normal_smoothing_size);
        if (isTaken ("setNormalSmoothingSize", status, normal_smoothing_size, "finite and above 0"))
          options_.normal_smoothing_size = normal_smoothing_size;
      }

      /** \brief Set the method.
        * \param[in] normal_estimation_method the method
        */
      void
      setNormalEstimationMethod (NormalEstimationMethod normal_estimation_method)
      {
        options_.normal_estimation_method = normal_estimation_method;
      }

      /** \brief Set whether a tenth of a pixel's z (signed, in the cloud's unit) is added to its smoothing size.
        * \param[in] use_depth_dependent_smoothing whether it is; default false
        */
      void
      setDepthDependentSmoothing (bool use_depth_dependent_smoothing)
      {
        options_.use_depth_dependent_smoothing = use_depth_dependent_smoothing;
      }

      /** \brief Set the cloud. It must be organized, and is read when compute is called.
        * \param[in] cloud the cloud
        * \throws pcl::InitFailedException if the border policy or the method is none of the enumerators
        */
      void
      setInputCloud (const typename PointCloudIn::ConstPtr &cloud) override
      {
        input_ = cloud;
        forgetMaps ();
        if (!cloud)
          return;
        if (!cloud->isOrganized ())
        {
          report ("setInputCloud", "the cloud is not organized (height = 1)");
          return;
        }
        if (use_sensor_origin_)
          readSensorOrigin ();
        if (!isKnownBorderPolicy ())
          PCL_THROW_EXCEPTION (pcl::InitFailedException,
                               "[iine::IntegralImageNormalEstimation::setInputCloud] unknown border policy.");
        if (!isKnownMethod ())
          PCL_THROW_EXCEPTION (pcl::InitFailedException,
                               "[iine::IntegralImageNormalEstimation::setInputCloud] unknown normal estimation method.");
      }

      /** \brief Get the distance of every pixel of the last computed cloud to the nearest depth change, in pixels.
        *
        * It is computed by the first call after a compute, from the cloud as it is then. Without any depth change in the
        * image it is width + height, with SEMANTICS_PAPER infinity.
        * \return width * height values, row by row, valid until the next \ref setInputCloud or compute; null unless
        * there was a compute since \ref setInputCloud, and the last one succeeded
        */
      float *
      getDistanceMap ()
      {
        if (!has_maps_)
          return (nullptr);
        if (distance_map_.empty () && !computeMap ("getDistanceMap", distance_map_, 1, &iine_maps::distances))
        {
          forgetMaps ();
          return (nullptr);
        }
        return (distance_map_.data ());
      }

      /** \brief Get where there are depth changes in the last computed cloud. Not in PCL's class.
        *
        * This map and those below are computed by the call, from the cloud as it is then and the options of the last
        * compute. They are those of the smoothing area map's own windows, whatever \ref setOneSidedWindows and
        * \ref setCreaseWindows say.
        * \param[out] map width * height values, row by row: 1 at a depth change, else 0. With SEMANTICS_PCL both pixels of a
        * change are marked, and those at and beside a z that is not finite, but two of the last row or column are never told
        * apart, as in PCL; with SEMANTICS_PAPER the pixel before the change (Eq. 7): of missing points only the last one
        * before a change across them
        * \return whether it was computed; if not (unless there was a compute since \ref setInputCloud, and the last one
        * succeeded), the map is empty and an error is printed
        */
      bool
      getDepthChangeMap (std::vector<std::uint8_t> &map)
      {
        return (computeMap ("getDepthChangeMap", map, 1, &iine_maps::depth_changes));
      }

      /** \brief Get the window of every pixel of the last computed cloud. Not in PCL's class.
        * \param[out] map width * height values, row by row: the window's side in pixels, or with SEMANTICS_PAPER its
        * radius R (Eq. 8); 0 where there is none
        * \return as \ref getDepthChangeMap
        */
      bool
      getSmoothingAreaMap (std::vector<float> &map)
      {
        return (computeMap ("getSmoothingAreaMap", map, 1, &iine_maps::smoothing_areas));
      }

      /** \brief Get the radius that the depth of every pixel of the last computed cloud asks for (the paper's B,
        * Eq. 5). Not in PCL's class; with SEMANTICS_PAPER only.
        * \param[out] map width * height values in pixels, row by row; NaN at missing points
        * \return as \ref getDepthChangeMap
        */
      bool
      getDepthRadiusMap (std::vector<float> &map)
      {
        return (computeMap ("getDepthRadiusMap", map, 1, &iine_maps::depth_radii,
                            "the last compute had SEMANTICS_PCL or SIMPLE_3D_GRADIENT, which have no depth radii"));
      }

      /** \brief Get the eigenvalues of the covariance matrix of every pixel's window of the last computed cloud. Not in
        * PCL's class; with COVARIANCE_MATRIX only.
        * \param[out] map 3 * width * height values in the cloud's unit squared, row by row: three for every pixel,
        * ascending; NaN where there is no window, or no finite point in it
        * \return as \ref getDepthChangeMap
        */
      bool
      getEigenvalueMap (std::vector<float> &map)
      {
        return (computeMap ("getEigenvalueMap", map, 3, &iine_maps::eigenvalues,
                            "the last compute was not with COVARIANCE_MATRIX, which alone has eigenvalues"));
      }

      /** \brief Set the point that normals are turned towards, instead of the cloud's sensor origin.
        * \param[in] vpx its x coordinate
        * \param[in] vpy its y coordinate
        * \param[in] vpz its z coordinate
        */
      void
      setViewPoint (float vpx, float vpy, float vpz)
      {
        options_.vpx = vpx;
        options_.vpy = vpy;
        options_.vpz = vpz;
        use_sensor_origin_ = false;
      }

      /** \brief Get the point that normals are turned towards: as set, else the cloud's sensor origin when it was
        * set, else the origin.
        * \param[out] vpx its x coordinate
        * \param[out] vpy its y coordinate
        * \param[out] vpz its z coordinate
        */
      void
      getViewPoint (float &vpx, float &vpy, float &vpz)
      {
        vpx = options_.vpx;
        vpy = options_.vpy;
        vpz = options_.vpz;
      }

      /** \brief Turn normals towards the cloud's sensor origin, of the cloud set now and of those set later. */
      void
      useSensorOriginAsViewPoint ()
      {
        use_sensor_origin_ = true;
        if (input_)
          readSensorOrigin ();
        else
          options_.vpx = options_.vpy = options_.vpz = 0.0f;
      }

      /** \brief Set the number of threads; the result does not depend on it. Not in PCL's class.
        * \param[in] number_of_threads 1 (the default) computes on the calling thread, 0 takes one per processor; above 1024 it
        * is refused with a printed error
        */
      void
      setNumberOfThreads (unsigned number_of_threads)
      {
        const int status = iine_estimator_set_threads (handle_.get (), number_of_threads);
        if (isTaken ("setNumberOfThreads", status, number_of_threads, "at most 1024"))
          options_.number_of_threads = number_of_threads;
      }

      /** \brief Set whose definition of the windows and sums is followed. Not in PCL's class.
        *
        * With SEMANTICS_PAPER the border policy, the smoothing size, depth dependent smoothing and the depth change
        * factor have no effect; setPaper* set what takes their place. docs/paper.md has the equations.
        * \param[in] semantics the semantics; default SEMANTICS_PCL
        */
      void
      setSemantics (Semantics semantics)
      {
        options_.semantics = semantics;
      }

      /** \brief Set alpha: the smallest depth change that the sensor can tell at depth d is alpha d^2 (Eq. 4). Used by
        * SEMANTICS_PAPER, and by \ref setOneSidedWindows and \ref setCreaseWindows. Not in PCL's class.
        * \param[in] alpha in 1/unit of length, finite and above 0, default 0.0028; anything else is refused with a
        * printed error. \ref alphaOfSensor gives it
        */
      void
      setPaperAlpha (float alpha)
      {
        const int status = iine_estimator_set_paper_alpha (handle_.get (), alpha);
        if (isTaken ("setPaperAlpha", status, alpha, "finite and above 0"))
          options_.paper_alpha = alpha;
      }

      /** \brief Set beta: the radius of the window is beta alpha d^2 (Eq. 5). Not in PCL's class.
        * \param[in] beta in pixels/unit of length, finite and above 0, default 1200; anything else is refused with a
        * printed error
        */
      void
      setPaperBeta (float beta)
      {
        const int status = iine_estimator_set_paper_beta (handle_.get (), beta);
        if (isTaken ("setPaperBeta", status, beta, "finite and above 0"))
          options_.paper_beta = beta;
      }

      /** \brief Set gamma: neighbours whose depths differ by gamma alpha d^2 or more are a depth change apart (Eq. 6).
        * Not in PCL's class.
        * \param[in] gamma without unit, finite and above 0, default 5; anything else is refused with a printed error
        */
      void
      setPaperGamma (float gamma)
      {
        const int status = iine_estimator_set_paper_gamma (handle_.get (), gamma);
        if (isTaken ("setPaperGamma", status, gamma, "finite and above 0"))
          options_.paper_gamma = gamma;
      }

      /** \brief Set the limits of the window's radius with SEMANTICS_PAPER, in pixels; the largest is also that of
        * \ref setOneSidedWindows and \ref setCreaseWindows. Not in PCL's class.
        *
        * 1 <= smallest_radius <= least_depth_radius <= largest_radius <= 1000; anything else is refused with a printed error.
        * \param[in] smallest_radius where the radius is below this there is no window; default 2
        * \param[in] least_depth_radius the depth asks for at least this; default 5
        * \param[in] largest_radius and for at most this; default 20
        */
      void
      setPaperRadii (unsigned smallest_radius, unsigned least_depth_radius, unsigned largest_radius)
      {
        const int status =
            iine_estimator_set_paper_radii (handle_.get (), smallest_radius, least_depth_radius, largest_radius);
        const std::string radii = std::to_string (smallest_radius) + ", " + std::to_string (least_depth_radius) + ", "
            + std::to_string (largest_radius);
        if (!isTaken ("setPaperRadii", status, radii,
                      "1 <= smallest_radius <= least_depth_radius <= largest_radius <= 1000"))
          return;
        options_.smallest_radius = smallest_radius;
        options_.least_depth_radius = least_depth_radius;
        options_.largest_radius = largest_radius;
      }

      /** \brief Set how the distance to the nearest depth change is measured with SEMANTICS_PAPER. Not in PCL's class.
        * \param[in] distance_metric the metric; default DISTANCE_METRIC_EUCLIDEAN
        */
      void
      setPaperDistanceMetric (DistanceMetric distance_metric)
      {
        options_.distance_metric = distance_metric;
      }

      /** \brief Set what a point's depth is with SEMANTICS_PAPER. Not in PCL's class.
        * \param[in] depth the depth; default DEPTH_Z
        */
      void
      setPaperDepth (Depth depth)
      {
        options_.depth = depth;
      }

      /** \brief Set whether points at (0, 0, 0) are missing, as LiDARs and some depth cameras write them. Not in PCL's
        * class.
        * \param[in] zero_is_missing whether they are; default false
        */
      void
      setZeroIsMissing (bool zero_is_missing)
      {
        options_.zero_is_missing = zero_is_missing;
      }

      /** \brief Set whether pixels near a depth change get a window on their own side of it, so that every pixel with two
        * neighbours on its surface that are not in line with it has a normal. With either semantics, and the alpha of
        * \ref setPaperAlpha, the gamma of \ref setPaperGamma and the largest radius of \ref setPaperRadii. Not in PCL's class.
        * \param[in] one_sided_windows whether they do; default false
        */
      void
      setOneSidedWindows (bool one_sided_windows)
      {
        options_.one_sided_windows = one_sided_windows;
      }

      /** \brief Set whether a second pass gives every pixel, but on round surfaces, that window around or beside it whose
        * plane is expected to be nearest to the surface (docs/paper.md), so that edges without a depth change stay sharp and
        * flat surfaces become smoother. With either semantics, and the alpha of \ref setPaperAlpha and the largest
        * radius of \ref setPaperRadii. Not in PCL's class.
        * \param[in] crease_windows whether it does; default false
        */
      void
      setCreaseWindows (bool crease_windows)
      {
        options_.crease_windows = crease_windows;
      }

      /** \brief The alpha of a stereo or structured light sensor: disparity_step / (focal * baseline). Not in PCL's
        * class.
        * \param[in] disparity_step its smallest step of disparity, in pixels
        * \param[in] focal its focal length, in pixels
        * \param[in] baseline its baseline, in the cloud's unit
        * \return the alpha for \ref setPaperAlpha
        */
      static float
      alphaOfSensor (float disparity_step, float focal, float baseline)
      {
        return (iine_alpha_of_sensor (disparity_step, focal, baseline));
      }

      /** \brief Get how much scratch memory is held for the next compute. Not in PCL's class.
        * \return the size in bytes, without the maps
        */
      std::size_t
      getScratchSize ()
      {
        std::size_t bytes = 0;
        iine_estimator_scratch_size (handle_.get (), &bytes);
        return (bytes);
      }

      /** \brief Free the scratch memory and end the worker threads; the next compute makes them anew. Not in PCL's class. */
      void
      releaseScratch ()
      {
        iine_estimator_release_scratch (handle_.get ());
      }

      /** \brief Get the outcome of the last compute, \ref computePointNormal or \ref computePointNormalMirror. Not in
        * PCL's class.
        * \return IINE_OK (0), or one of IINE_ERROR_*, whose text iine_status_string gives; IINE_ERROR_SIZE for a cloud that
        * is not organized
        */
      int
      getLastStatus () const
      {
        return (last_status_);
      }

    protected:
      /** \brief Check the cloud and provide indices; builds no search tree. */
      bool
      initCompute () override
      {
        forgetMaps ();
        last_status_ = checkInput ();
        if (last_status_ != IINE_OK)
        {
          report ("initCompute", explain (last_status_));
          return (false);
        }
        // The list of all indices that the base class keeps is shared by copies: each takes its own.
        if (fake_indices_ && indices_.use_count () > 1)
        {
          indices_.reset ();
          fake_indices_ = false;
        }
        if (!pcl::PCLBase<PointInT>::initCompute () || (fake_indices_ && indices_->size () != input_->size ()))
        {
          last_status_ = IINE_ERROR_OUT_OF_MEMORY;
          report ("initCompute", explain (last_status_));
          return (false);
        }
        const bool has_radius = std::fpclassify (search_radius_) != FP_ZERO;
        search_parameter_ = has_radius ? search_radius_ : static_cast<double> (k_);
        return (true);
      }

      /** \brief Compute the normals of the whole cloud or of the indices.
        *
        * If that fails all normals are NaN, the status says why, and an error is printed. That includes
        * SIMPLE_3D_GRADIENT with SEMANTICS_PAPER.
        * \param[out] output the normals, its size already right
        * \throws pcl::PCLException for SIMPLE_3D_GRADIENT with BORDER_POLICY_MIRROR
        */
      void
      computeFeature (PointCloudOut &output) override
      {
        output.sensor_origin_ = input_->sensor_origin_;
        output.sensor_orientation_ = input_->sensor_orientation_;
        output.is_dense = false;

        last_status_ = computeNormals (output);
        if (last_status_ == IINE_OK)
        {
          has_maps_ = true;
          computed_options_ = options_;
          // Without pixels it may go with BORDER_POLICY_MIRROR, but the maps do not.
          if (options_.normal_estimation_method == SIMPLE_3D_GRADIENT)
            computed_options_.border_policy = BORDER_POLICY_IGNORE;
          return;
        }
        for (auto &point : output)
          clearNormal (point);
        throwIfUnsupported (last_status_);
        report ("compute", explain (last_status_));
      }

    private:
      /** \brief The options of the C estimator, with PCL's names and defaults. */
      struct Options
      {
        NormalEstimationMethod normal_estimation_method = AVERAGE_3D_GRADIENT;
        BorderPolicy border_policy = BORDER_POLICY_IGNORE;
        bool use_depth_dependent_smoothing = false;
        float max_depth_change_factor = 20.0f * 0.001f;
        float normal_smoothing_size = 10.0f;
        float vpx = 0.0f;
        float vpy = 0.0f;
        float vpz = 0.0f;
        unsigned number_of_threads = 1;
        Semantics semantics = SEMANTICS_PCL;
        float paper_alpha = 0.0028f;
        float paper_beta = 1200.0f;
        float paper_gamma = 5.0f;
        unsigned smallest_radius = 2;
        unsigned least_depth_radius = 5;
        unsigned largest_radius = 20;
        DistanceMetric distance_metric = DISTANCE_METRIC_EUCLIDEAN;
        Depth depth = DEPTH_Z;
        bool zero_is_missing = false;
        bool one_sided_windows = false;
        bool crease_windows = false;
      };

      /** \brief The C estimator, made when it is first used. A copy gets one of its own. */
      class Handle
      {
        public:
          Handle () = default;
          Handle (const Handle &) noexcept {}
          ~Handle () = default;

          Handle &
          operator= (const Handle &) noexcept
          {
            return (*this);
          }

          /** \brief Get the estimator; null if it cannot be made. */
          iine_estimator *
          get ()
          {
            if (!estimator_)
            {
              iine_estimator *made = nullptr;
              if (iine_estimator_new (&made) == IINE_OK)
                estimator_.reset (made);
            }
            return (estimator_.get ());
          }

        private:
          struct Free
          {
            void
            operator() (iine_estimator *estimator) const
            {
              iine_estimator_free (estimator);
            }
          };

          std::unique_ptr<iine_estimator, Free> estimator_;
      };

      bool
      isKnownBorderPolicy () const
      {
        const int policy = static_cast<int> (options_.border_policy);
        return (policy == BORDER_POLICY_IGNORE || policy == BORDER_POLICY_MIRROR);
      }

      bool
      isKnownMethod () const
      {
        const int method = static_cast<int> (options_.normal_estimation_method);
        return (method >= COVARIANCE_MATRIX && method <= SIMPLE_3D_GRADIENT);
      }

      /** \brief Whether there is an organized cloud whose points are as many as its width and height say. */
      int
      checkInput () const
      {
        if (!input_)
          return (IINE_ERROR_NULL_POINTER);
        const std::size_t size = static_cast<std::size_t> (input_->width) * input_->height;
        return (input_->isOrganized () && size != 0 && size == input_->size () ? IINE_OK : IINE_ERROR_SIZE);
      }

      void
      readSensorOrigin ()
      {
        options_.vpx = input_->sensor_origin_.coeff (0);
        options_.vpy = input_->sensor_origin_.coeff (1);
        options_.vpz = input_->sensor_origin_.coeff (2);
      }

      /** \brief Hand all options to the C estimator.
        * \param[in] options the options
        * \return a status
        */
      int
      setOptions (const Options &options)
      {
        iine_estimator *e = handle_.get ();
        if (e == nullptr)
          return (IINE_ERROR_OUT_OF_MEMORY);
        const int statuses[] = {
            iine_estimator_set_method (e, static_cast<int> (options.normal_estimation_method)),
            iine_estimator_set_border_policy (e, static_cast<int> (options.border_policy)),
            iine_estimator_set_normal_smoothing_size (e, options.normal_smoothing_size),
            iine_estimator_set_depth_dependent_smoothing (e, options.use_depth_dependent_smoothing ? 1 : 0),
            iine_estimator_set_max_depth_change_factor (e, options.max_depth_change_factor),
            iine_estimator_set_viewpoint (e, options.vpx, options.vpy, options.vpz),
            iine_estimator_set_threads (e, options.number_of_threads),
            iine_estimator_set_semantics (e, static_cast<int> (options.semantics)),
            iine_estimator_set_paper_alpha (e, options.paper_alpha),
            iine_estimator_set_paper_beta (e, options.paper_beta),
            iine_estimator_set_paper_gamma (e, options.paper_gamma),
            iine_estimator_set_paper_radii (e, options.smallest_radius, options.least_depth_radius,
                                            options.largest_radius),
            iine_estimator_set_paper_distance_metric (e, static_cast<int> (options.distance_metric)),
            iine_estimator_set_paper_depth (e, static_cast<int> (options.depth)),
            iine_estimator_set_zero_is_missing (e, options.zero_is_missing ? 1 : 0),
            iine_estimator_set_one_sided_windows (e, options.one_sided_windows ? 1 : 0),
            iine_estimator_set_crease_windows (e, options.crease_windows ? 1 : 0)};
        for (const int status : statuses)
          if (status != IINE_OK)
            return (status);
        return (IINE_OK);
      }

      /** \brief Whether a setter of the C API took its value; if not, an error is printed.
        * \param[in] member the member function that was called
        * \param[in] status what the setter returned
        * \param[in] value the value
        * \param[in] rule what values have to be
        */
      template <typename Value> static bool
      isTaken (const char *member, int status, const Value &value, const char *rule)
      {
        if (status == IINE_ERROR_OPTION_VALUE)
          reportRefused (member, value, rule);
        else if (status != IINE_OK) // the estimator could not be made
          report (member, explain (IINE_ERROR_OUT_OF_MEMORY));
        return (status == IINE_OK);
      }

      /** \brief The cloud's memory as the C API takes it; the cloud has been checked. */
      iine_points
      inputPoints () const
      {
        const PointInT &first = input_->points.front ();
        iine_points points = {};
        points.struct_size = sizeof (points);
        points.width = input_->width;
        points.height = input_->height;
        points.x = &first.x;
        points.y = &first.y;
        points.z = &first.z;
        points.point_stride = sizeof (PointInT);
        return (points);
      }

      /** \brief Memory for normals as the C API takes it.
        * \param[in] first the first of them
        */
      static iine_normals
      outputNormals (PointOutT &first)
      {
        iine_normals normals = {};
        normals.struct_size = sizeof (normals);
        normals.nx = &first.normal_x;
        normals.ny = &first.normal_y;
        normals.nz = &first.normal_z;
        normals.point_stride = sizeof (PointOutT);
        normals.curvature = &first.curvature;
        normals.curvature_point_stride = sizeof (PointOutT);
        return (normals);
      }

      static void
      clearNormal (PointOutT &normal)
      {
        normal.normal_x = normal.normal_y = normal.normal_z = normal.curvature =
            std::numeric_limits<float>::quiet_NaN ();
      }

      /** \brief Whether the indices are 0, 1, 2, ... up to the cloud's last. */
      bool
      areIndicesWholeCloud () const
      {
        if (indices_->size () != input_->size ())
          return (false);
        if (fake_indices_)
          return (true);
        for (std::size_t i = 0; i < indices_->size (); ++i)
          if (static_cast<std::size_t> ((*indices_)[i]) != i)
            return (false);
        return (true);
      }

      int
      computeNormals (PointCloudOut &output)
      {
        // Checked again: where the output is the input cloud, it has been resized to the indices meanwhile.
        int status = checkInput ();
        if (status == IINE_OK)
          status = setOptions (options_);
        if (status != IINE_OK || output.empty ())
          return (status);
        const iine_points points = inputPoints ();
        const iine_normals normals = outputNormals (output.points.front ());
        if (areIndicesWholeCloud ())
          return (iine_estimator_compute (handle_.get (), &points, &normals));
        static_assert (std::is_same<pcl::index_t, std::int32_t>::value, "the C API takes signed 32-bit indices");
        return (iine_estimator_compute_indices (handle_.get (), &points, indices_->data (), indices_->size (),
                                                &normals));
      }

      void
      computeWindow (const char *member, BorderPolicy border_policy, int pos_x, int pos_y, PointOutT &normal)
      {
        last_status_ = checkInput ();
        Options options = options_;
        options.border_policy = border_policy;
        if (last_status_ == IINE_OK)
          last_status_ = setOptions (options);
        if (last_status_ == IINE_OK)
        {
          const iine_points points = inputPoints ();
          const iine_normals normals = outputNormals (normal);
          // Negative positions become ones outside the cloud, which are refused.
          last_status_ = iine_estimator_compute_window (handle_.get (), &points, static_cast<std::uint32_t> (pos_x),
                                                        static_cast<std::uint32_t> (pos_y), rect_width_,
                                                        rect_height_, &normals);
        }
        if (last_status_ == IINE_OK)
          return;
        clearNormal (normal);
        throwIfUnsupported (last_status_);
        if (last_status_ == IINE_ERROR_OPTION_VALUE && (rect_width_ < 0 || rect_height_ < 0))
          reportRefused (member, std::to_string (rect_width_) + " x " + std::to_string (rect_height_),
                         "setRectSize's sizes are 0 or above");
        else
          report (member, explain (last_status_));
      }

      /** \brief Compute one of the maps from the cloud as it is and the options of the last compute.
        * \param[in] member the member function that was called
        * \param[out] map the map, empty if it cannot be had
        * \param[in] values_per_pixel how many values a pixel has
        * \param[in] field the map's field in the struct of the C API
        * \param[in] unsupported why the last compute may have no such map
        * \return whether it was computed; if not, an error is printed
        */
      template <typename Value> bool
      computeMap (const char *member, std::vector<Value> &map, std::size_t values_per_pixel,
                  Value *iine_maps::*field, const char *unsupported = explain (IINE_ERROR_UNSUPPORTED))
      {
        map.clear ();
        if (!has_maps_)
        {
          report (member, "nothing has been computed from this cloud, or the last compute failed");
          return (false);
        }
        int status = checkInput ();
        if (status == IINE_OK)
          status = setOptions (computed_options_);
        if (status == IINE_OK)
        {
          map.resize (input_->size () * values_per_pixel);
          const iine_points points = inputPoints ();
          iine_maps maps = {};
          maps.struct_size = sizeof (maps);
          maps.*field = map.data ();
          status = iine_estimator_compute_maps (handle_.get (), &points, &maps);
        }
        if (status == IINE_OK)
          return (true);
        map.clear ();
        report (member, status == IINE_ERROR_UNSUPPORTED ? unsupported : explain (status));
        return (false);
      }

      void
      forgetMaps ()
      {
        has_maps_ = false;
        distance_map_.clear ();
      }

      /** \brief Throw where PCL throws: for SIMPLE_3D_GRADIENT with BORDER_POLICY_MIRROR. */
      void
      throwIfUnsupported (int status) const
      {
        if (status == IINE_ERROR_UNSUPPORTED && options_.semantics == SEMANTICS_PCL)
          PCL_THROW_EXCEPTION (pcl::PCLException,
                               "[iine::IntegralImageNormalEstimation] SIMPLE_3D_GRADIENT does not support "
                               "BORDER_POLICY_MIRROR.");
      }

      /** \brief The text of a status, in this class's words where it has its own. */
      static const char *
      explain (int status)
      {
        switch (status)
        {
          case IINE_ERROR_NULL_POINTER:
            return ("no input cloud was set");
          case IINE_ERROR_SIZE:
            return ("the cloud is not organized (height = 1), or its size is not its width times its height, or it is "
                    "empty or too large");
          case IINE_ERROR_OPTION_VALUE: // setters have refused numbers
            return ("the method, border policy, semantics, distance metric or depth is none of the enumerators");
          case IINE_ERROR_UNSUPPORTED: // with BORDER_POLICY_MIRROR it throws
            return ("SIMPLE_3D_GRADIENT does not go with SEMANTICS_PAPER");
          default:
            return (iine_status_string (status));
        }
      }

      static void
      report (const char *member, const char *text)
      {
        PCL_ERROR ("[iine::IntegralImageNormalEstimation::%s] %s.\n", member, text);
      }

      template <typename Value> static void
      reportRefused (const char *member, const Value &value, const char *rule)
      {
        PCL_ERROR_STREAM ("[iine::IntegralImageNormalEstimation::" << member << "] " << value << " is refused: " << rule
                          << ".\n");
      }

      /** \brief The options set. */
      Options options_;

      /** \brief The options at the last compute, which the maps belong to. */
      Options computed_options_;

      /** \brief The window of computePointNormal. */
      int rect_width_ = 0;
      int rect_height_ = 0;

      /** \brief Whether the viewpoint is the cloud's sensor origin. */
      bool use_sensor_origin_ = true;

      /** \brief The outcome of the last computation. */
      int last_status_ = IINE_OK;

      /** \brief Whether there are maps to compute when they are asked for. */
      bool has_maps_ = false;

      /** \brief The distance map; empty until it is asked for. */
      std::vector<float> distance_map_;

      /** \brief The C estimator. */
      Handle handle_;

    public:
      PCL_MAKE_ALIGNED_OPERATOR_NEW
  };
}
