#define MAQ_FIELD_KERNELS field_kernels_avx512
#include "head/field/field_kernels_body.h"
