#include "diagnosis/candidates/suspects.hpp"

#include <algorithm>

#include "model/input_error.hpp"

namespace vcnc {
namespace {

bool means(const std::string& suspect, const Candidate& c) {
  return suspect == c.name() || suspect == c.effect || suspect == c.place;
}

bool means(const std::string& suspect, const std::string& key) {
  if (suspect == key || key.starts_with("effects." + suspect + ".")) return true;
  const bool anywhere = suspect.find('.') == std::string::npos;
  return anywhere && key.starts_with("effects.") &&
         key.find("." + suspect + ".") != std::string::npos;
}

template <class What>
bool is_any(const std::vector<std::string>& suspects, const What& what) {
  return suspects.empty() || std::any_of(suspects.begin(), suspects.end(),
                                         [&](const std::string& s) { return means(s, what); });
}

}  // namespace

bool is_suspected(const std::vector<std::string>& suspects, const Candidate& candidate) {
  return is_any(suspects, candidate);
}

bool is_suspected(const std::vector<std::string>& suspects, const std::string& key) {
  return is_any(suspects, key);
}

std::vector<Candidate> suspected(std::vector<Candidate> all,
                                 const std::vector<std::string>& numbers,
                                 const std::vector<std::string>& suspects) {
  for (const std::string& s : suspects) {
    const bool known =
        std::any_of(all.begin(), all.end(), [&](const Candidate& c) { return means(s, c); }) ||
        std::any_of(numbers.begin(), numbers.end(),
                    [&](const std::string& key) { return means(s, key); });
    if (!known)
      throw InputError("--suspect: \"" + s +
                       "\" is no effect that a diagnosis would try and no declared number with a "
                       "tolerance; allowed: an effect (backlash), one at a place (X.backlash), a "
                       "key (axes.X.load_kg); vcnc effects lists them");
  }
  std::erase_if(all, [&](const Candidate& c) { return !is_suspected(suspects, c); });
  return all;
}

}  // namespace vcnc
