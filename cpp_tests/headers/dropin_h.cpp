// The drop-in header alone and twice, then its implementation's and the class's own.
#include <pcl/features/integral_image_normal.h>
#include <pcl/features/integral_image_normal.h>
#include <pcl/features/impl/integral_image_normal.hpp>
#include <iine/pcl/integral_image_normal.h>

#ifndef IINE_PCL_DROPIN
#error "PCL's header was found, not ours"
#endif
