#include "apps/plan_command.hpp"

#include <fmt/format.h>

#include <iostream>
#include <iterator>
#include <optional>
#include <string_view>

#include "apps/operations.hpp"
#include "apps/output_file.hpp"
#include "bus/tick.hpp"
#include "configs/config.hpp"
#include "controller/limit_use.hpp"
#include "controller/player.hpp"

namespace vcnc {
namespace {

constexpr std::string_view kHeader =
    "time_s,X_mm,Y_mm,Z_mm,A_deg,C_deg,tip_X_mm,tip_Y_mm,tip_Z_mm,feed_mm_min,line\n";

/// Every cycle as one line of a CSV file; without a path, none.
class PlanCsv {
 public:
  explicit PlanCsv(const std::string& path) {
    if (path.empty()) return;
    file_.emplace("--csv", path, kHeader);
    file_->stream() << kHeader;
  }

  void add(Tick cycle, const PlayerStep& step) {
    if (!file_) return;
    text_.clear();
    const auto out = std::back_inserter(text_);
    fmt::format_to(out, "{:.3f}", seconds(cycle));
    for (std::size_t i = 0; i < kAxisCount; ++i)
      fmt::format_to(out, ",{:.7f}", step.position[i] / (is_rotary(i) ? kDegree : 1e-3));
    for (const double x : step.tip) fmt::format_to(out, ",{:.7f}", x * 1e3);
    fmt::format_to(out, ",{:.4f},{}\n", step.feed * 60e3, step.line);
    file_->stream() << text_;
  }

  void close() {
    if (file_) file_->commit();
  }

 private:
  std::optional<OutputFile> file_;
  std::string text_;
};

/// What the operator does in this cycle.
void operate(Player& player, OperatorPanel& panel, Tick cycle, int line) {
  if (panel.empty()) return;
  for (const Operation& operation : panel.due(cycle, line)) {
    if (operation.kind == Operation::Kind::hold) player.feed_hold();
    if (operation.kind == Operation::Kind::start) player.cycle_start();
  }
  player.operate(panel.switches());
  player.attended(panel.start_to_come());
}

}  // namespace

void plan_command(const PlanOptions& options) {
  std::vector<std::string> assignments = options.assignments;
  if (!options.dynamics.empty()) assignments.push_back("nc.dynamics=" + options.dynamics);
  const Machine machine =
      with_program_path(load_machine(options.machine, assignments), options.how.program_path);
  OperatorPanel panel(read_operations(options.operations));
  try {
    Player player(options.program, machine, player_options(options.how, options.program));
    if (player.begins_at()) std::cout << text_of_begin(player) << '\n';
    AxisVector start;
    for (std::size_t i = 0; i < kAxisCount; ++i) start[i] = machine.axes[i].limits.start;
    LimitUse use(machine, start);
    PlanCsv csv(options.csv);
    Tick cycles = 0, waiting = 0, at_zero = 0;
    PlayerStep step;
    while (true) {
      operate(player, panel, cycles, step.line);
      at_zero = player.stands_at_zero() ? at_zero + 1 : 0;
      if (seconds(at_zero) > kProgramStopSeconds && !panel.timed_to_come())
        throw InputError(
            fmt::format("--operate: the axes stand on line {} at an override of 0 %, "
                        "and nothing more is operated",
                        step.line));
      step = player.step();
      if (step.done) break;
      use.add(step.position);
      csv.add(++cycles, step);
      waiting += step.dwell;
    }
    csv.close();
    for (const std::string& text : panel.never())
      std::cerr << "vcnc: warning: --operate \"" << text << "\": there was no occasion for it\n";
    std::cout << fmt::format("total time {:.3f} s, of which {:.3f} s waiting\n", seconds(cycles),
                             seconds(waiting));
    std::cout << "largest share of the limits   v [%]   a [%]   j [%]\n";
    for (std::size_t i = 0; i < kAxisCount; ++i)
      std::cout << fmt::format("{:<27}{:8.1f}{:8.1f}{:8.1f}\n", kAxisNames[i],
                               use.share(i, 1) * 100, use.share(i, 2) * 100, use.share(i, 3) * 100);
  } catch (const ProgramError& e) {
    throw InputError(e.what());
  }
}

}  // namespace vcnc
