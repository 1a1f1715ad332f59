#include "apps/effects_command.hpp"

#include <iostream>

#include "configs/effect_reference.hpp"

namespace vcnc {

void effects_command(const EffectsOptions& options) {
  if (options.json && options.markdown)
    throw InputError("vcnc effects: --json and --markdown exclude each other");
  if (!options.show.empty())
    std::cout << effect_page(options.show);
  else if (options.json)
    std::cout << effect_json();
  else if (options.markdown)
    std::cout << effect_markdown();
  else
    std::cout << effect_table();
}

}  // namespace vcnc
