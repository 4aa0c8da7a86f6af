// The class's header alone and twice.
#include <iine/pcl/integral_image_normal.h>
#include <iine/pcl/integral_image_normal.h>
