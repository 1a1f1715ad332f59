// Questions to a replica that several searches ask at the same time, answered together.
//
// A replica predicts several machines quicker than one after the other (Replica::predict_all), but
// a search asks for one at a time, since the next depends on the last. So searches run as members
// of a gathering, each in a thread of its own; who asks waits until every member asks or has left,
// and all questions are answered at once. Answers do not depend on who else asks.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "diagnosis/replica/replica.hpp"

namespace vcnc {

class Gathering {
 public:
  /// `replica` must outlive this.
  explicit Gathering(const Replica& replica) : replica_(replica) {}

  /// From members and others. Throws what the replica throws.
  std::vector<Prediction> predict_all(const std::vector<Machine>& hypotheses);

  /// Calls f(0) ... f(n - 1), each as a member. What f throws first is thrown again here.
  template <class F>
  void each(std::size_t n, F&& f) {
    std::exception_ptr thrown;
    std::mutex guard;
    const auto work = [&](std::size_t i) {
      try {
        f(i);
      } catch (...) {
        const std::lock_guard lock(guard);
        if (!thrown) thrown = std::current_exception();
      }
      leave();
    };
    join(n);
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < n; ++i) threads.emplace_back(work, i);
    for (std::thread& thread : threads) thread.join();
    if (thrown) std::rethrow_exception(thrown);
  }

 private:
  struct Question {
    const std::vector<Machine>& hypotheses;
    std::vector<Prediction> answer;
    std::exception_ptr thrown;
    bool answered = false;
  };

  void join(std::size_t members);
  void leave();
  void answer_if_all_ask(std::unique_lock<std::mutex>& lock);
  void answer(const std::vector<Question*>& questions) const;

  const Replica& replica_;
  std::mutex mutex_;
  std::condition_variable answered_;
  std::size_t members_ = 0;
  std::vector<Question*> asked_;
};

}  // namespace vcnc
