#include "bus/fault_docs.hpp"

#include <fmt/format.h>

#include "bus/fault.hpp"

namespace vcnc {

namespace {

constexpr const char* kHead = R"(# Faults

`vcnc run --fault "NODE KIND key=value ..."`, as often as needed, or the key `faults` of a scenario
of `vcnc lockout`:

```
vcnc run scan.ngc --machine m.toml --out o --fault "probe mute from_s=1.5 for_s=0.005"
vcnc run scan.ngc --machine m.toml --out o --random-faults 3 --seed 7
vcnc lockout --only faulted-17
```

| key | meaning |
|---|---|
| `from_s` | beginning [s], 0 |
| `for_s` | duration [s], else to the end; of faults of the host in host time |
| `at=contact` | scenarios only: `from_s` counts from the first touch and may be negative |
| `wall_s` | faults of the host: beginning in host time since the first process was started [s], instead of `from_s` |
| `id` | identifier of a frame, e.g. `0x187` |
| `bit` | of the payload, 0 .. 511 |
| `cycles`, `frames`, `periods` | see the kind |
| `um`, `urad` | jump of a linear, of a rotary axis |
| `channel` | `x`, `y` or `z` of the probe |

NODE is drive X, Y, Z, A, C or spindle, probe, overtravel, NC unit, bus (all modules) or supply; for
faults of the host also analysis. What a run suffered is kept in `faults.txt` of its folder; a fault
that never had an effect is told at the end.
)";

const char* what(FaultPlace place) {
  switch (place) {
    case FaultPlace::module_or_bus:
      return "module, bus";
    case FaultPlace::one_node:
      return "module, NC unit";
    case FaultPlace::module:
      return "module";
    case FaultPlace::supply:
      return "supply";
    case FaultPlace::bus:
      return "bus";
    case FaultPlace::axis:
      return "axis drive";
    case FaultPlace::probe:
      return "probe";
    case FaultPlace::process:
      return "any process";
    case FaultPlace::analysis:
      return "analysis";
    case FaultPlace::node:
      break;
  }
  return "module, NC unit, bus";
}

std::string keys_of(const FaultKind& kind) {
  std::string keys;
  std::string_view rest = kind.keys;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    keys += fmt::format("{}`{}`", keys.empty() ? "" : ", ", rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return keys;
}

std::string table(bool of_host) {
  std::string text =
      "\n| kind | of | keys | means | what the machine makes of it |\n|---|---|---|---|---|\n";
  for (const FaultKind& kind : fault_kinds()) {
    if (BusFault{.node = "", .kind = kind.kind}.of_host() != of_host) continue;
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n", kind.name, what(kind.place),
                        keys_of(kind), kind.means, kind.detected);
  }
  return text;
}

}  // namespace

std::string faults_markdown() {
  return kHead + std::string("\n## In simulated time\n") + table(false) +
         "\nThe same fault gives the same trace hash in one process and in many.\n" +
         "\n## Of the host, on real processes\n" + table(true) +
         "\nA module that is stopped longer than `--answer-timeout-s` is lost.\n";
}

}  // namespace vcnc
