#include "apps/control_pipe.hpp"

#include <unistd.h>

namespace vcnc {

void ControlPipe::line(std::string text) const {
  if (fd_ < 0) return;
  text += '\n';
  // Short lines are written whole (PIPE_BUF); a launcher that is gone is noticed by the bus.
  [[maybe_unused]] const auto written = ::write(fd_, text.data(), text.size());
}

}  // namespace vcnc
