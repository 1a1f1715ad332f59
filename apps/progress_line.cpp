#include "apps/progress_line.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <iostream>

namespace vcnc {

namespace {

constexpr std::chrono::seconds kNowAndThen{30};

}  // namespace

ProgressLine::ProgressLine()
    : terminal_(::isatty(STDERR_FILENO) == 1),
      begun_(std::chrono::steady_clock::now()),
      told_(begun_) {}

void ProgressLine::show(const std::string& text) {
  if (!terminal_) {
    const auto now = std::chrono::steady_clock::now();
    if (now - told_ < kNowAndThen) return;
    told_ = now;
    const auto since = std::chrono::duration_cast<std::chrono::seconds>(now - begun_);
    std::cerr << "after " << since.count() << " s: " << text << std::endl;
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
