// A folder for one generated page; nothing of the user's is ever lost in it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace vcnc {

/// The folder named by --out: new, empty, or with an earlier page of the same kind, which is the
/// file `name` with `mark` as its second line. Throws InputError for any other.
std::filesystem::path page_folder(const std::string& out, const std::string& name,
                                  std::string_view mark);

}  // namespace vcnc
