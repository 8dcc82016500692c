// worker_orders.h -- the loop in which a worker obeys the orders of its driver (worker_protocol.h).
#pragma once

#include <iostream>
#include <sstream>
#include <string>

namespace bench {

// Reads orders until the standard input ends. `obey_other(order, word, words)` is called for orders that not all workers
// know: `word` is the first behind the order, `words` has those behind it.
template <typename Worker, typename ObeyOther>
void serve(Worker& worker, const ObeyOther& obey_other) {
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string order, word;
    words >> order >> word;
    if (order == "run")
      worker.run();
    else if (order == "save")
      worker.save(word);
    else if (order == "memory")
      worker.tell_memory();
    else
      obey_other(order, word, words);
  }
}

}  // namespace bench
