#include "diagnosis/evidence/gathering.hpp"

#include <utility>

namespace vcnc {

std::vector<Prediction> Gathering::predict_all(const std::vector<Machine>& hypotheses) {
  std::unique_lock lock(mutex_);
  if (members_ == 0) {
    lock.unlock();
    return replica_.predict_all(hypotheses);
  }
  Question question{hypotheses, {}, nullptr};
  asked_.push_back(&question);
  answer_if_all_ask(lock);
  answered_.wait(lock, [&] { return question.answered; });
  if (question.thrown) std::rethrow_exception(question.thrown);
  return std::move(question.answer);
}

void Gathering::join(std::size_t members) {
  const std::lock_guard lock(mutex_);
  members_ += members;
}

void Gathering::leave() {
  std::unique_lock lock(mutex_);
  --members_;
  answer_if_all_ask(lock);
}

void Gathering::answer_if_all_ask(std::unique_lock<std::mutex>& lock) {
  if (asked_.empty() || asked_.size() < members_) return;
  const std::vector<Question*> questions = std::exchange(asked_, {});
  lock.unlock();
  answer(questions);
  lock.lock();
  for (Question* q : questions) q->answered = true;
  answered_.notify_all();
}

void Gathering::answer(const std::vector<Question*>& questions) const {
  std::vector<Machine> all;
  for (const Question* q : questions)
    all.insert(all.end(), q->hypotheses.begin(), q->hypotheses.end());
  try {
    std::vector<Prediction> answers = replica_.predict_all(all);
    auto next = answers.begin();
    for (Question* q : questions)
      for (std::size_t i = 0; i < q->hypotheses.size(); ++i)
        q->answer.push_back(std::move(*next++));
  } catch (...) {
    // One of them cannot be answered: who asked it shall know.
    for (Question* q : questions) {
      try {
        q->answer = replica_.predict_all(q->hypotheses);
      } catch (...) {
        q->thrown = std::current_exception();
      }
    }
  }
}

}  // namespace vcnc
