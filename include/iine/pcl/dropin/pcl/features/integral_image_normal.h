/*
 * SPDX-License-Identifier: BSD-3-Clause
 *
 * Stands before PCL's header of this name in the include path: pcl::IntegralImageNormalEstimation becomes another
 * name of iine::IntegralImageNormalEstimation. Nothing is defined under the names that libpcl_features exports.
 */

#pragma once

#include <iine/pcl/integral_image_normal.h>

// What PCL's header brings along.
#include <pcl/features/feature.h>
#include <pcl/features/integral_image2D.h>
#include <pcl/memory.h>
#include <pcl/pcl_macros.h>
#include <pcl/point_cloud.h>

/** \brief Defined where pcl::IntegralImageNormalEstimation is iine's class. */
#define IINE_PCL_DROPIN 1

namespace pcl
{
  /** \brief iine's class under PCL's name. */
  template <typename PointInT, typename PointOutT>
  using IntegralImageNormalEstimation = iine::IntegralImageNormalEstimation<PointInT, PointOutT>;
}

// As at the end of PCL's header.
#ifdef PCL_NO_PRECOMPILE
#include <pcl/features/impl/integral_image_normal.hpp>
#endif
