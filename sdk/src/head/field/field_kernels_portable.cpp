#define MAQ_FIELD_KERNELS field_kernels_portable
#include "head/field/field_kernels_body.h"
