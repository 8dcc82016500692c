// layer_namespaces.h -- the namespaces of the compiler's folders, bottom up. The table belongs to no layer.
//
// Each folder has a namespace of its own name and imports the namespaces of the layers below it (docs/architecture.md),
// so that code refers to their names without a prefix. `simplify` is a function, so its folder's namespace is
// `simplification`. User code lives in `retrograde`, which has its own LoopLevel and print; folders that see both
// write graph::LoopLevel and ir::print.
#pragma once

// clang-format off
namespace retrograde::ir {}
namespace retrograde::simplification { using namespace ir; }
namespace retrograde::analysis { using namespace ir; }
namespace retrograde::graph { using namespace simplification; using namespace analysis; }
namespace retrograde::frontend { using namespace graph; }
namespace retrograde::transform { using namespace graph; }
namespace retrograde::autodiff { using namespace transform; }
namespace retrograde::lower { using namespace graph; }
namespace retrograde::checks { using namespace graph; }
namespace retrograde::tuning { using namespace graph; }
namespace retrograde::driver { using namespace graph; }
// clang-format on
