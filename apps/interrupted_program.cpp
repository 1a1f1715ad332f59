#include "apps/interrupted_program.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "configs/config.hpp"
#include "model/input_error.hpp"

namespace vcnc {

NcRecord identity_of(const Machine& machine, const std::string& piece_toml,
                     const std::string& program, const PlayerOptions& options) {
  std::ifstream in(program, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(in), {});
  if (in.bad() || !in.is_open()) throw InputError(program + ": cannot be read");
  if (options.from_line > 0) text += fmt::format("\nfrom line {}", options.from_line);
  if (options.interpreter.block_delete) text += "\nblock delete";
  if (options.interpreter.dialect != InterpreterOptions::Dialect::automatic)
    text += fmt::format("\ndialect {}", static_cast<int>(options.interpreter.dialect));
  if (options.interpreter.tools) text += '\n' + options.interpreter.tools->to_text(1);
  Machine content = machine;
  content.setup.piece.clear();  // its place does not matter, what it says does
  content.nc.program_path.clear();
  NcRecord identity;
  identity.program = std::filesystem::absolute(program).string();
  identity.program_hash = hash_of(text);
  identity.machine_hash = hash_of(to_toml(content) + piece_toml);
  return identity;
}

KeptNcData load_nc_data(NodeMemory& memory) {
  const std::vector<std::uint8_t> bytes = memory.load();
  if (bytes.empty()) return {};
  std::optional<KeptNcData> data = decode_nc_data(bytes);
  if (!data) refuse_state("NC unit's offsets and tools");
  return std::move(*data);
}

void check_resume(const std::optional<NcRecord>& kept, const NcRecord& now,
                  const std::string& memory) {
  if (!kept || !resumable(kept->stage))
    throw InputError(fmt::format("--resume: {} holds no interrupted program ({})", memory,
                                 text_of(kept ? kept->stage : RunStage::none)));
  if (kept->program_hash != now.program_hash)
    throw InputError(
        fmt::format("--resume: {} is not the program that was interrupted, {} as it "
                    "was then",
                    now.program, kept->program));
  if (kept->machine_hash != now.machine_hash)
    throw InputError(
        "--resume: the machine or its piece is not the one on which the program was interrupted; "
        "its file, --set and --inject have to be the same");
}

void check_fresh(const std::optional<NcRecord>& kept, const std::string& memory) {
  if (!kept || !resumable(kept->stage)) return;
  throw InputError(fmt::format(
      "--memory {}: {} was interrupted {:.3f} s into the program; go on with --resume, or drop it "
      "with `vcnc reset {}`",
      memory, kept->program, seconds(kept->held.cycles), memory));
}

}  // namespace vcnc
