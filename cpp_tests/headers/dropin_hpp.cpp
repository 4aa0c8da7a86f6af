// The drop-in header of PCL's implementation alone and twice, then the other one.
#include <pcl/features/impl/integral_image_normal.hpp>
#include <pcl/features/impl/integral_image_normal.hpp>
#include <pcl/features/integral_image_normal.h>

#ifndef IINE_PCL_DROPIN
#error "PCL's header was found, not ours"
#endif
