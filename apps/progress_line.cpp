#include "apps/progress_line.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <iostream>

namespace vcnc {

namespace {

constexpr double kNowAndThen = 30;  // [s]

}  // namespace

ProgressLine::ProgressLine() : terminal_(::isatty(STDERR_FILENO) == 1) {}

void ProgressLine::show(const std::string& text) {
  if (!terminal_) {
    const double now_s = clock_.elapsed();
    if (now_s - told_s_ < kNowAndThen) return;
    told_s_ = now_s;
    std::cerr << fmt::format("after {:.0f} s: {}", now_s, text) << std::endl;
    return;
  }
  if (shown_ && text == text_) return;
  text_ = text;
  winsize size{};
  ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size);
  const std::size_t width = size.ws_col > 1 ? size.ws_col - 1u : 79u;
  std::cerr << "\r\033[K" << text.substr(0, width) << std::flush;
  shown_ = true;
}

void ProgressLine::clear() {
  if (shown_) std::cerr << "\r\033[K" << std::flush;
  shown_ = false;
}

}  // namespace vcnc
