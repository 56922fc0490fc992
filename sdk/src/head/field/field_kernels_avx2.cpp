#define MAQ_FIELD_KERNELS field_kernels_avx2
#include "head/field/field_kernels_body.h"
