#include "apps/compensate_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "analysis/whole_file.hpp"
#include "apps/compensation_effect.hpp"
#include "apps/compensation_for.hpp"
#include "apps/machine_output.hpp"
#include "apps/node_options.hpp"
#include "configs/config.hpp"

namespace vcnc {
namespace {

constexpr double kLarger = 1.1;  ///< times what it was: told

void print(const std::vector<CompensationRemark>& remarks) {
  if (remarks.empty()) std::cout << "The machine has no effects; nothing is compensated.\n";
  for (const bool compensated : {true, false}) {
    const auto belongs = [&](const CompensationRemark& r) { return r.compensated == compensated; };
    if (std::none_of(remarks.begin(), remarks.end(), belongs)) continue;
    std::cout << (compensated ? "Compensated:\n" : "Not compensated:\n");
    for (const CompensationRemark& remark : remarks)
      if (belongs(remark)) std::cout << fmt::format("  {:<26} {}\n", remark.effect, remark.text);
  }
}

void print(const std::vector<PassComparison>& passes) {
  std::cout << fmt::format("\n{:<22}{:>22}{:>24}\n{:<22}{:>10}{:>12}{:>12}{:>12}\n",
                           "dynamic error [um]", "rms", "largest", "", "before", "after", "before",
                           "after");
  for (const PassComparison& p : passes)
    std::cout << fmt::format("{:<22}{:>10.2f}{:>12.2f}{:>12.2f}{:>12.2f}\n",
                             p.motion + ", " + p.pass, p.before.rms * 1e6, p.after.rms * 1e6,
                             p.before.largest * 1e6, p.after.largest * 1e6);
  for (const PassComparison& p : passes) {
    const std::string pass = p.motion + ", " + p.pass;
    if (p.after.rms > p.before.rms)
      std::cout << "warning: " << pass << ": the settings make it worse; a load that no friction "
                << "holds may be anywhere in its gap\n";
    else if (p.after.largest > kLarger * p.before.largest)
      std::cout << "note: " << pass << ": the largest error grows, a spike while a gap is crossed; "
                << "a shorter transition_ms leaves a smaller one\n";
  }
}

}  // namespace

int compensate_command(const CompensateOptions& options) {
  if (options.out.empty() && !options.measure)
    throw InputError("vcnc compensate: needs --out FILE, --measure or both");
  std::error_code error;
  if (std::filesystem::equivalent(options.machine, options.out, error))
    throw InputError("--out " + options.out + ": is the machine itself");
  if (!options.out.empty()) check_machine_output(options.out);
  const Machine machine = load_machine(options.machine, options.assignments, options.injections);
  const CompensationProposal proposal = compensation_for(machine);
  print(proposal.remarks);
  if (!options.out.empty()) {
    Machine compensated = machine;
    compensated.nc.compensation = proposal.settings;
    write_whole_file(options.out, brief_toml(compensated));
    std::cout << "machine: " << options.out << '\n';
  }
  if (options.measure) print(compare_compensation(machine, proposal.settings));
  return kExitOk;
}

}  // namespace vcnc
