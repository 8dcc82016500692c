// Runs a function on a thread with a large stack, as compilation does: sanitizers make frames
// several times larger.
#pragma once

#include <pthread.h>

#include <functional>

namespace retrograde::test {

inline void on_large_stack(std::function<void()> body) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, size_t{1} << 30);
  pthread_t thread;
  const auto run = [](void* f) -> void* {
    return (*static_cast<std::function<void()>*>(f))(), nullptr;
  };
  const int failed = pthread_create(&thread, &attributes, run, &body);
  pthread_attr_destroy(&attributes);
  if (failed) {
    body();
  } else {
    pthread_join(thread, nullptr);
  }
}

}  // namespace retrograde::test
