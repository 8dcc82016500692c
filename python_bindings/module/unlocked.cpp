// unlocked.cpp -- the worker thread, and waiting for it while polling for signals.
#include "unlocked.h"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace retrograde::python {

namespace {

using Work = std::function<void(const Interruption&)>;

struct Job {
  Work work;
  Interruption interruption = std::make_shared<std::atomic<bool>>(false);
  std::exception_ptr error;
  bool done = false;
};

// A thread that runs the main thread's jobs one after another.
class Worker {
 public:
  void start(std::shared_ptr<Job> job) {
    {
      std::lock_guard lock(mutex_);
      job_ = std::move(job);
    }
    changed_.notify_all();
  }
  // Waits for the job; returns whether it ended within the time.
  bool wait(const Job& job, std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return job.done; });
  }
  // Makes the thread end after the current job.
  void retire() {
    std::lock_guard lock(mutex_);
    retired_ = true;
    changed_.notify_all();
  }

  static void loop(const std::shared_ptr<Worker>& self) {
    while (std::shared_ptr<Job> job = self->next()) {
      try {
        job->work(job->interruption);
      } catch (...) {
        job->error = std::current_exception();
      }
      job->work = nullptr;  // releases the objects that it held
      std::lock_guard lock(self->mutex_);
      job->done = true;
      self->changed_.notify_all();
    }
  }

 private:
  std::shared_ptr<Job> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return job_ || retired_; });
    return std::exchange(job_, nullptr);
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<Job> job_;
  bool retired_ = false;
};

// The worker of the main thread, which alone uses it, so there is no lock. After fork() the child starts a new one.
struct Hired {
  std::shared_ptr<Worker> worker;
  pid_t process = 0;
};
Hired hired;

Worker& worker() {
  if (hired.worker && hired.process == getpid()) return *hired.worker;
  if (hired.worker)
    new std::shared_ptr<Worker>(
        std::move(hired.worker));  // leaked: its locks belong to the parent process
  hired = {std::make_shared<Worker>(), getpid()};
  std::thread([self = hired.worker] { Worker::loop(self); }).detach();
  return *hired.worker;
}

bool is_main_thread() {
  static const unsigned long main_thread =
      py::module_::import("threading").attr("main_thread")().attr("ident").cast<unsigned long>();
  return PyThread_get_thread_ident() == main_thread;
}

// Waits for a job. Holds the GIL only while it polls for signals.
void wait_for(const std::shared_ptr<Job>& job, Worker& worker) {
  const auto interval = std::chrono::milliseconds(20);
  while (true) {
    {
      py::gil_scoped_release release;
      if (worker.wait(*job, interval)) return;
    }
    if (PyErr_CheckSignals() != 0) {
      job->interruption->store(true);
      worker.retire();
      hired = {};
      throw py::error_already_set();
    }
  }
}

}  // namespace

Kept keep(py::object object) {
  return Kept(object.release().ptr(), [](void* kept) {
    if (!Py_IsInitialized()) return;
    const PyGILState_STATE state = PyGILState_Ensure();
    Py_DECREF(static_cast<PyObject*>(kept));
    PyGILState_Release(state);
  });
}

void run_unlocked(Work work) {
  if (!is_main_thread()) {
    py::gil_scoped_release release;
    work(std::make_shared<std::atomic<bool>>(false));
    work = nullptr;
    return;
  }
  auto job = std::make_shared<Job>();
  job->work = std::move(work);
  Worker& on = worker();
  on.start(job);
  wait_for(job, on);
  // Moved out of the job, because the other thread may release the job later than this one.
  if (std::exception_ptr error = std::exchange(job->error, nullptr))
    std::rethrow_exception(std::move(error));
}

}  // namespace retrograde::python
