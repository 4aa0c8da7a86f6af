/*
 * SPDX-License-Identifier: BSD-3-Clause
 *
 * Stands before PCL's file of this name: there is nothing to add to the header-only class.
 */

#pragma once

#include <pcl/features/integral_image_normal.h>

/** \brief Instantiates the class explicitly, as PCL's macro of this name. */
#define PCL_INSTANTIATE_IntegralImageNormalEstimation(T, NT) template class iine::IntegralImageNormalEstimation<T, NT>;
