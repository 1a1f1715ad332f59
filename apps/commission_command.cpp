#include "apps/commission_command.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>

#include "analysis/whole_file.hpp"
#include "apps/keep_memory.hpp"
#include "apps/machine_output.hpp"
#include "apps/node_options.hpp"
#include "apps/progress_line.hpp"
#include "apps/stop_signal.hpp"
#include "configs/config.hpp"
#include "diagnosis/commission.hpp"
#include "diagnosis/records/any_record.hpp"
#include "diagnosis/replica/checked_replica.hpp"
#include "diagnosis/report/diagnosis_text.hpp"

namespace vcnc {

int commission_command(const CommissionOptions& options) {
  keep_memory();
  catch_stop_signals(kStopping);
  const Record record = load_record(options.run, options.map, options.model);
  const Machine declared = declared_machine(options.model, record);
  std::error_code error;
  if (!options.model.empty() && std::filesystem::equivalent(options.model, options.out, error))
    throw InputError("--out " + options.out + ": is the declared machine itself");
  check_machine_output(options.out);
  std::vector<std::string> of_times;
  const auto replica = checked_replica(record, declared, of_times);
  ProgressLine progress;
  const auto keep_going = [&](const DiagnosisProgress& p) {
    progress.show(fmt::format("{} {:.0f} %", p.doing, p.share * 100));
    return !stop_requested();
  };
  const Commissioning c =
      commission({record, *replica, declared, candidates(declared, record)}, {}, keep_going);
  progress.clear();
  if (c.numbers.empty() && !stop_requested())
    throw InputError(record.source +
                     ": tells nothing of the declared machine that could be fitted; nothing is "
                     "written");
  for (const std::string& note : c.notes) std::cout << note << '\n';
  for (const FittedNumber& n : c.numbers)
    std::cout << fmt::format("  {} = {}\n", n.key, with_interval(n));
  std::cout << figures_table(c.figures);
  for (const std::string& warning : record.warnings) std::cerr << "vcnc: " << warning << '\n';
  for (const std::string& warning : of_times) std::cerr << "vcnc: " << warning << '\n';
  for (const std::string& warning : c.warnings) std::cerr << "vcnc: " << warning << '\n';
  if (stop_requested()) {
    std::cout << options.out << ": interrupted, nothing is written\n";
    return kExitInterrupted;
  }
  write_whole_file(options.out, brief_toml(c.machine));
  std::cout << "model: " << options.out << '\n';
  return kExitOk;
}

}  // namespace vcnc
