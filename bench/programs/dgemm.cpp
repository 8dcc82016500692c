// dgemm -- see matrix_product.h; double precision.
#include "matrix_product.h"

PROGRAM(dgemm, programs::MatrixProduct, products<double>())
