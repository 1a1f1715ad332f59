#include "apps/output_file.hpp"

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "model/input_error.hpp"

namespace vcnc {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHead = 1000;

bool is_special(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error) && !fs::is_regular_file(path, error);
}

std::string head_of(const std::string& path) {
  std::string head(kHead, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

}  // namespace

void refuse_foreign_output(const std::string& option, const std::string& path,
                           std::string_view mark) {
  std::error_code error;
  if (fs::is_directory(path, error)) throw InputError(option + " " + path + ": is a folder");
  if (!fs::exists(path, error) || is_special(path)) return;
  const std::string head = head_of(path);
  if (!head.empty() && head.find(mark) == head.npos)
    throw InputError(option + " " + path +
                     ": exists and is no earlier output of this command; it needs a new file");
}

OutputFile::OutputFile(const std::string& option, std::string path, std::string_view mark)
    : path_(std::move(path)) {
  refuse_foreign_output(option, path_, mark);
  if (!is_special(path_)) {
    whole_ = std::make_unique<WholeFile>(path_);
    return;
  }
  direct_.open(path_, std::ios::binary);
  if (!direct_) throw std::runtime_error(path_ + ": cannot be written");
}

std::ostream& OutputFile::stream() {
  if (whole_) return whole_->stream();
  return direct_;
}

std::optional<std::string> OutputFile::so_far() {
  if (!whole_) return std::nullopt;
  if (!whole_->stream().flush()) whole_->commit();  // says why
  return path_ + WholeFile::kTemporary;
}

void OutputFile::commit() {
  if (whole_) return whole_->commit();
  direct_.close();
  if (!direct_) throw std::runtime_error(path_ + ": cannot be written completely");
}

}  // namespace vcnc
