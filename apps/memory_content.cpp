#include "apps/memory_content.hpp"

#include <fmt/format.h>

#include "probe_sim/overtravel_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace vcnc {

MemoryContent read_content(const MemoryFolder& folder) {
  MemoryContent content;
  const auto state = [&](const char* owner) { return SlotFiles(folder.path(), owner).load(); };
  if (const auto kept = state("nc"); !kept.empty()) {
    content.nc = decode_record(kept);
    if (!content.nc) refuse_state("NC unit");
  }
  if (const auto kept = state("data"); !kept.empty()) {
    const auto data = decode_nc_data(kept);
    if (!data) refuse_state("NC unit's offsets and tools");
    content.data = data->now;
  }
  if (const auto kept = state("spindle"); !kept.empty()) {
    const auto locked = decode_spindle_lock(kept);
    if (!locked) refuse_state("spindle");
    content.spindle_locked = *locked;
  }
  if (const auto kept = state("overtravel"); !kept.empty()) {
    const auto latch = decode_protection_latch(kept);
    if (!latch) refuse_state("overtravel module");
    content.overtravel = *latch;
  }
  return content;
}

namespace {

std::string text_of(const ProtectionLatch& latch) {
  if (latch.state < ProtectionState::soft_stop) return "not latched";
  return fmt::format("latched, {}: {}, {:.3f} mm",
                     latch.state == ProtectionState::hard ? "HARD" : "SOFT_STOP",
                     vcnc::text_of(latch.cause), latch.deflection * 1e3);
}

std::string text_of(const AxisVector& q) {
  std::string text;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    text += fmt::format("{}{}{:.4f}", i > 0 ? " " : "", kAxisNames[i],
                        q[i] / (is_rotary(i) ? kDegree : 1e-3));
  return text;
}

}  // namespace

std::string to_text(const MemoryContent& content) {
  std::string text;
  if (!content.nc || content.nc->stage == RunStage::none) {
    text = "program      none\n";
  } else {
    const NcRecord& r = *content.nc;
    text = fmt::format("program      {}\n             {}, {:.3f} s after switch-on\n", r.program,
                       text_of(r.stage), seconds(r.cycle));
    if (r.alarm != 0) text += fmt::format("             its first alarm was {}\n", r.alarm);
    if (resumable(r.stage))
      text += fmt::format(
          "             held {:.3f} s into the program at {} (mm, deg)\n             axes stood at "
          "{}\n             goes on with --resume\n",
          seconds(r.held.cycles), text_of(r.path_point), text_of(r.position));
  }
  text += fmt::format("NC check     {}\n",
                      text_of(content.nc ? content.nc->protection : ProtectionLatch{}));
  text += fmt::format("overtravel   {}\n", text_of(content.overtravel));
  text += fmt::format("spindle      {}\n", content.spindle_locked ? "locked" : "not locked");
  text += to_text(content.data);
  return text;
}

}  // namespace vcnc
