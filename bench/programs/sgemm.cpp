// sgemm -- see matrix_product.h; single precision.
#include "matrix_product.h"

PROGRAM(sgemm, programs::MatrixProduct, products<float>())
