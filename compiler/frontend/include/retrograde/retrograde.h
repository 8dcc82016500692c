// retrograde.h -- everything that a pipeline's author needs, in one include.
#pragma once

#include "autodiff/derivative.h"
#include "diagnostics/error.h"
#include "frontend/boundary_conditions.h"
#include "frontend/buffer.h"
#include "frontend/expr_ops.h"
#include "frontend/func.h"
#include "frontend/image_param.h"
#include "frontend/inline_reductions.h"
#include "frontend/lambda.h"
#include "frontend/module.h"
#include "frontend/param.h"
#include "frontend/pipeline.h"
#include "frontend/rdom.h"
#include "frontend/var.h"
#include "ir/print.h"
#include "ir/target.h"
