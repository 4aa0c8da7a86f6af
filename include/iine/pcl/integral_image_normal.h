/*
 * SPDX-License-Identifier: BSD-3-Clause
 *
 * iine::IntegralImageNormalEstimation: the interface of pcl::IntegralImageNormalEstimation over libiine.
 */

#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
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
    * What differs from PCL's class:
    * - the cloud is read when compute is called, not when it is set;
    * - output k belongs to indices[k] whatever the indices are, and equals what the whole cloud gives there;
    * - results are defined where PCL reads or writes out of bounds (see docs/pcl-compatibility.md);
    * - objects can be copied, moved, and reused for clouds of any size;
    * - no search tree is built, and the search parameters of the base class have no effect.
    *
    * One object is used by one thread at a time; different objects freely.
    *
    * \tparam PointInT a point type with float x, y, z
    * \tparam PointOutT a point type with float normal_x, normal_y, normal_z, curvature; its other fields stay as
    * they are. The output may be the input cloud itself.
    */
  template <typename PointInT, typename PointOutT>
  class IntegralImageNormalEstimation : public pcl::Feature<PointInT, PointOutT>
  {
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
        BORDER_POLICY_IGNORE, ///< the outer int(normal smoothing size) rows and columns get no normal
        BORDER_POLICY_MIRROR  ///< windows are folded back at the border
      };

      /** \brief How a normal is computed from the points in a pixel's window. */
      enum NormalEstimationMethod
      {
        COVARIANCE_MATRIX,    ///< eigenvector of the smallest eigenvalue of the covariance matrix; gives a curvature
        AVERAGE_3D_GRADIENT,  ///< cross product of the mean 3-D gradients
        AVERAGE_DEPTH_CHANGE, ///< cross product of smoothed depth changes
        SIMPLE_3D_GRADIENT    ///< cross product of the differences of the outermost strips; not with MIRROR
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

      /** \brief Move constructor; what was moved from can be used further. */
      IntegralImageNormalEstimation (IntegralImageNormalEstimation &&) = default;

      /** \brief Copy assignment. */
      IntegralImageNormalEstimation &
      operator= (const IntegralImageNormalEstimation &) = default;

      /** \brief Move assignment. */
      IntegralImageNormalEstimation &
      operator= (IntegralImageNormalEstimation &&) = default;

      /** \brief Destructor. */
      ~IntegralImageNormalEstimation () override = default;

      /** \brief Set the window of \ref computePointNormal and \ref computePointNormalMirror. It has no effect on
        * compute, which chooses a window for every pixel; nor does compute change it.
        * \param[in] width the width in pixels
        * \param[in] height the height in pixels
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
        border_policy_ = border_policy;
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
        computeWindow (BORDER_POLICY_IGNORE, pos_x, pos_y, normal);
      }

      /** \brief As \ref computePointNormal, with the window folded back at the border of the image.
        * \param[in] pos_x the pixel's column
        * \param[in] pos_y the pixel's row
        * \param[in] point_index the pixel's index, pos_y * width + pos_x (not used)
        * \param[out] normal the normal and the curvature, NaN if there is none
        * \throws pcl::PCLException for SIMPLE_3D_GRADIENT
        */
      void
      computePointNormalMirror (const int pos_x, const int pos_y, const unsigned point_index, PointOutT &normal)
      {
        static_cast<void> (point_index);
        computeWindow (BORDER_POLICY_MIRROR, pos_x, pos_y, normal);
      }

      /** \brief Set the factor f of the depth change threshold: neighbours whose z differ by more than
        * 2 f (|z| + 1) are on different surfaces.
        * \param[in] max_depth_change_factor the factor, in the cloud's unit
        */
      void
      setMaxDepthChangeFactor (float max_depth_change_factor)
      {
        max_depth_change_factor_ = max_depth_change_factor;
      }

      /** \brief Set the side of the largest window.
        * \param[in] normal_smoothing_size the side in pixels, finite and above 0; anything else is refused with a
        * printed error
        */
      void
      setNormalSmoothingSize (float normal_smoothing_size)
      {
        if (!std::isfinite (normal_smoothing_size) || normal_smoothing_size <= 0)
        {
          PCL_ERROR ("[iine::%s::setNormalSmoothingSize] %f is not a finite number above 0; the size stays %f.\n",
                     feature_name_.c_str (), normal_smoothing_size, normal_smoothing_size_);
          return;
        }
        normal_smoothing_size_ = normal_smoothing_size;
      }

      /** \brief Set the method.
        * \param[in] normal_estimation_method the method
        */
      void
      setNormalEstimationMethod (NormalEstimationMethod normal_estimation_method)
      {
        normal_estimation_method_ = normal_estimation_method;
      }

      /** \brief Set whether a tenth of a pixel's z is added to its smoothing size.
        * \param[in] use_depth_dependent_smoothing whether it is
        */
      void
      setDepthDependentSmoothing (bool use_depth_dependent_smoothing)
      {
        use_depth_dependent_smoothing_ = use_depth_dependent_smoothing;
      }

      /** \brief Set the cloud. It must be organized, and is read when compute is called.
        * \param[in] cloud the cloud
        * \throws pcl::InitFailedException if the border policy or the method is none of the enumerators
        */
      void
      setInputCloud (const typename PointCloudIn::ConstPtr &cloud) override
      {
        input_ = cloud;
        forgetDistanceMap ();
        if (!cloud)
          return;
        if (!cloud->isOrganized ())
        {
          PCL_ERROR ("[iine::%s::setInputCloud] The cloud is not organized (height = 1).\n",
                     feature_name_.c_str ());
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
        * It is computed by the first call after a compute, from the cloud as it is then.
        * \return width * height values, row by row, valid until the next \ref setInputCloud or compute; null if there
        * has been no successful compute since \ref setInputCloud
        */
      float *
      getDistanceMap ()
      {
        if (!has_distance_map_)
          return (nullptr);
        if (distance_map_.empty ())
        {
          const int status = computeDistanceMap ();
          if (status != IINE_OK)
          {
            report ("getDistanceMap", status);
            forgetDistanceMap ();
            return (nullptr);
          }
        }
        return (distance_map_.data ());
      }

      /** \brief Set the point that normals are turned towards, instead of the cloud's sensor origin.
        * \param[in] vpx its x coordinate
        * \param[in] vpy its y coordinate
        * \param[in] vpz its z coordinate
        */
      void
      setViewPoint (float vpx, float vpy, float vpz)
      {
        vpx_ = vpx;
        vpy_ = vpy;
        vpz_ = vpz;
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
        vpx = vpx_;
        vpy = vpy_;
        vpz = vpz_;
      }

      /** \brief Turn normals towards the cloud's sensor origin, of the cloud set now and of those set later. */
      void
      useSensorOriginAsViewPoint ()
      {
        use_sensor_origin_ = true;
        if (input_)
          readSensorOrigin ();
        else
          vpx_ = vpy_ = vpz_ = 0.0f;
      }

      /** \brief Set the number of threads; the result does not depend on it. Not in PCL's class.
        * \param[in] number_of_threads at most 1024; 1 (the default) computes on the calling thread, 0 takes one per
        * core
        */
      void
      setNumberOfThreads (unsigned number_of_threads)
      {
        number_of_threads_ = number_of_threads;
      }

      /** \brief Get the outcome of the last compute, \ref computePointNormal or \ref computePointNormalMirror. Not in
        * PCL's class.
        * \return IINE_OK (0), or one of IINE_ERROR_*, whose text iine_status_string gives
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
        forgetDistanceMap ();
        last_status_ = checkInput ();
        if (last_status_ != IINE_OK)
        {
          if (last_status_ == IINE_ERROR_NULL_POINTER)
            PCL_ERROR ("[iine::%s::initCompute] No input cloud was set.\n", feature_name_.c_str ());
          else
            PCL_ERROR ("[iine::%s::initCompute] The cloud is not organized (height = 1), or its size is not its "
                       "width times its height, or it is empty.\n", feature_name_.c_str ());
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
          report ("initCompute", last_status_);
          return (false);
        }
        search_parameter_ = search_radius_ != 0.0 ? search_radius_ : static_cast<double> (k_);
        return (true);
      }

      /** \brief Compute the normals of the whole cloud or of the indices.
        *
        * If that fails all normals are NaN, the status says why, and an error is printed.
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
          has_distance_map_ = true;
          computed_factor_ = max_depth_change_factor_;
          return;
        }
        for (auto &point : output)
          clearNormal (point);
        throwIfUnsupported (last_status_);
        report ("compute", last_status_);
      }

    private:
      /** \brief The C estimator, made when it is first used. A copy gets one of its own. */
      class Handle
      {
        public:
          Handle () = default;
          Handle (const Handle &) noexcept {}
          Handle (Handle &&) noexcept = default;
          ~Handle () = default;

          Handle &
          operator= (const Handle &) noexcept
          {
            return (*this);
          }

          Handle &
          operator= (Handle &&) noexcept = default;

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
        const int policy = static_cast<int> (border_policy_);
        return (policy == BORDER_POLICY_IGNORE || policy == BORDER_POLICY_MIRROR);
      }

      bool
      isKnownMethod () const
      {
        const int method = static_cast<int> (normal_estimation_method_);
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
        vpx_ = input_->sensor_origin_.coeff (0);
        vpy_ = input_->sensor_origin_.coeff (1);
        vpz_ = input_->sensor_origin_.coeff (2);
      }

      /** \brief Hand all options to the C estimator.
        * \param[in] border_policy the border policy, an enumerator or not
        * \return a status
        */
      int
      setOptions (int border_policy)
      {
        iine_estimator *estimator = handle_.get ();
        if (estimator == nullptr)
          return (IINE_ERROR_OUT_OF_MEMORY);
        const int method = static_cast<int> (normal_estimation_method_);
        int status = iine_estimator_set_method (estimator, method);
        if (status == IINE_OK)
          status = iine_estimator_set_border_policy (estimator, border_policy);
        if (status == IINE_OK)
          status = iine_estimator_set_normal_smoothing_size (estimator, normal_smoothing_size_);
        if (status == IINE_OK)
          status = iine_estimator_set_depth_dependent_smoothing (estimator, use_depth_dependent_smoothing_ ? 1 : 0);
        if (status == IINE_OK)
          status = iine_estimator_set_max_depth_change_factor (estimator, max_depth_change_factor_);
        if (status == IINE_OK)
          status = iine_estimator_set_viewpoint (estimator, vpx_, vpy_, vpz_);
        if (status == IINE_OK)
          status = iine_estimator_set_threads (estimator, number_of_threads_);
        return (status);
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
          status = setOptions (static_cast<int> (border_policy_));
        if (status != IINE_OK || output.empty ())
          return (status);
        const iine_points points = inputPoints ();
        const iine_normals normals = outputNormals (output.points.front ());
        if (areIndicesWholeCloud ())
          return (iine_estimator_compute (handle_.get (), &points, &normals));
        static_assert (sizeof (pcl::index_t) == sizeof (std::int32_t), "the C API takes 32-bit indices");
        return (iine_estimator_compute_indices (handle_.get (), &points, indices_->data (), indices_->size (),
                                                &normals));
      }

      void
      computeWindow (BorderPolicy border_policy, int pos_x, int pos_y, PointOutT &normal)
      {
        last_status_ = checkInput ();
        if (last_status_ == IINE_OK)
          last_status_ = setOptions (border_policy);
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
        report ("computePointNormal", last_status_);
      }

      int
      computeDistanceMap ()
      {
        int status = checkInput ();
        if (status != IINE_OK)
          return (status);
        iine_estimator *estimator = handle_.get ();
        if (estimator == nullptr)
          return (IINE_ERROR_OUT_OF_MEMORY);
        // Of all options only the factor matters to the map, but the method and the policy must go together.
        status = iine_estimator_set_border_policy (estimator, IINE_BORDER_POLICY_IGNORE);
        if (status == IINE_OK)
          status = iine_estimator_set_max_depth_change_factor (estimator, computed_factor_);
        if (status != IINE_OK)
          return (status);
        distance_map_.resize (input_->size ());
        const iine_points points = inputPoints ();
        iine_maps maps = {};
        maps.struct_size = sizeof (maps);
        maps.distances = distance_map_.data ();
        return (iine_estimator_compute_maps (estimator, &points, &maps));
      }

      void
      forgetDistanceMap ()
      {
        has_distance_map_ = false;
        distance_map_.clear ();
      }

      static void
      throwIfUnsupported (int status)
      {
        if (status == IINE_ERROR_UNSUPPORTED)
          PCL_THROW_EXCEPTION (pcl::PCLException, iine_status_string (status));
      }

      void
      report (const char *member, int status) const
      {
        PCL_ERROR ("[iine::%s::%s] %s.\n", feature_name_.c_str (), member, iine_status_string (status));
      }

      /** \brief The method. */
      NormalEstimationMethod normal_estimation_method_ = AVERAGE_3D_GRADIENT;

      /** \brief The border policy. */
      BorderPolicy border_policy_ = BORDER_POLICY_IGNORE;

      /** \brief The window of computePointNormal. */
      int rect_width_ = 0;
      int rect_height_ = 0;

      /** \brief Whether a tenth of z is added to the smoothing size. */
      bool use_depth_dependent_smoothing_ = false;

      /** \brief The factor of the depth change threshold. */
      float max_depth_change_factor_ = 20.0f * 0.001f;

      /** \brief The side of the largest window. */
      float normal_smoothing_size_ = 10.0f;

      /** \brief The point that normals are turned towards. */
      float vpx_ = 0.0f;
      float vpy_ = 0.0f;
      float vpz_ = 0.0f;

      /** \brief Whether that point is the cloud's sensor origin. */
      bool use_sensor_origin_ = true;

      /** \brief The number of threads asked for. */
      unsigned number_of_threads_ = 1;

      /** \brief The outcome of the last computation. */
      int last_status_ = IINE_OK;

      /** \brief Whether there is a distance map to give, or to compute when it is asked for. */
      bool has_distance_map_ = false;

      /** \brief The factor at the last compute, which the distance map belongs to. */
      float computed_factor_ = 0.0f;

      /** \brief The distance map; empty until it is asked for. */
      std::vector<float> distance_map_;

      /** \brief The C estimator. */
      Handle handle_;

    public:
      PCL_MAKE_ALIGNED_OPERATOR_NEW
  };
}
