// iine.h alone and twice, as C++14.
#include <iine/iine.h>
#include <iine/iine.h>

int iine_header_version_in_cpp ();

int
iine_header_version_in_cpp ()
{
  return IINE_VERSION_NUMBER;
}
