// Reading a file that may be damaged: once in a child process, so that a library that crashes on it
// or never returns takes only the child with it.
#pragma once

#include <filesystem>
#include <functional>

namespace vcnc {

/// Runs `read` in a child. Throws RecordingError with what that throws, or with `died` where the
/// child ended in another way or took longer than any sound file of this size.
void try_in_child(const std::filesystem::path& path, const char* died,
                  const std::function<void()>& read);

}  // namespace vcnc
