// rooms.h -- each folder of the compiler is a room with a namespace of its name, and says without a
// prefix what the rooms below are called; bottom up, as in docs/architecture.md. What users write is
// in `retrograde`, which has a LoopLevel and a print of its own: rooms that see it too say
// graph::LoopLevel and ir::print. `simplify` is a function, its room therefore `simplification`.
#pragma once

// clang-format off
namespace retrograde::ir {}
namespace retrograde::simplification { using namespace ir; }
namespace retrograde::analysis { using namespace ir; }
namespace retrograde::graph { using namespace simplification; using namespace analysis; }
namespace retrograde::frontend { using namespace graph; }
namespace retrograde::autoschedule { using namespace graph; }
namespace retrograde::autodiff { using namespace autoschedule; }
namespace retrograde::lower { using namespace graph; }
namespace retrograde::checks { using namespace graph; }
namespace retrograde::tuning { using namespace graph; }
// clang-format on
