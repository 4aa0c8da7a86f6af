/* iine.h alone and twice, as C99. */
#include <iine/iine.h>
#include <iine/iine.h>

int iine_header_version_in_c(void);

int
iine_header_version_in_c(void)
{
  return IINE_VERSION_NUMBER;
}
