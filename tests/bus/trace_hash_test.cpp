#include "bus/trace_hash.hpp"

#include <gtest/gtest.h>

#include <set>

namespace vcnc::trace_hash_test {
namespace {

Frame sample() {
  Frame frame;
  frame.id = 0x181;
  frame.len = 8;
  frame.data[0] = 1;
  return frame;
}

std::string hash_of(Tick k, const Frames& frames) {
  TraceHash hash;
  hash.add(k, frames);
  return hash.hex();
}

TEST(TraceHash, EmptyIsTheHashOfNothing) {
  EXPECT_EQ(TraceHash().hex(),
            "99aa06d3014798d86001c324468d497f");  // XXH3-128 of zero bytes, seed 0
}

TEST(TraceHash, EveryPartOfAFrameCounts) {
  std::set<std::string> all{hash_of(0, {sample()}), hash_of(1, {sample()}), hash_of(0, {}),
                            hash_of(0, {sample(), sample()})};
  Frame frame = sample();
  frame.id ^= 1;
  all.insert(hash_of(0, {frame}));
  frame = sample();
  frame.fd = true;
  all.insert(hash_of(0, {frame}));
  frame = sample();
  frame.len = 7;
  all.insert(hash_of(0, {frame}));
  frame = sample();
  frame.data[7] = 1;
  all.insert(hash_of(0, {frame}));
  EXPECT_EQ(all.size(), 8u);
  frame = sample();
  frame.data[8] = 1;  // behind the payload
  EXPECT_EQ(hash_of(0, {frame}), hash_of(0, {sample()}));
}

TEST(TraceHash, AskingDoesNotChangeIt) {
  TraceHash once, twice;
  once.add(0, Frames{sample()});
  twice.add(0, Frames{sample()});
  EXPECT_EQ(twice.hex(), twice.hex());
  once.add(1, Frames{sample()});
  twice.add(1, Frames{sample()});
  EXPECT_EQ(once.hex(), twice.hex());
}

}  // namespace
}  // namespace vcnc::trace_hash_test
