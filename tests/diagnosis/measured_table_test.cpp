#include "diagnosis/records/measured_table.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <random>

#include "diagnosis/records/time_base.hpp"
#include "tests/scratch.hpp"

namespace vcnc::measured_table_test {
namespace {

std::string refusal(const std::string& text, const TextFormat& format = {}) {
  try {
    parse_text_table(text, "run.csv", format);
  } catch (const MeasurementError& e) {
    return e.what();
  }
  return "";
}

TEST(MeasuredTable, ReadsEverySeparatorQuotesRemarksAndUnitLines) {
  for (const std::string text :
       {"t,q\n0,1.5\n0.001,-2e-3\n", "t;q\r\n0;1.5\r\n0.001;-2e-3\r\n",
        "t\tq\n0\t1.5\n0.001\t-2e-3", "# made by a logger\n\"t\",\"q\"\n0,\"1.5\"\n0.001,-2e-3\n",
        "t q\n 0  1.5\n0.001 -2e-3 \n", "# t,q\n0,1.5\n0.001,-2e-3\n",
        "t,q\ns,m\n0,1.5\n0.001,-2e-3\n", "t,q\ns,1\n0,1.5\n0.001,-2e-3\n",
        "\xEF\xBB\xBFt,q,\n0,+1.5,\n0.001,-2e-3,\n"}) {
    const MeasuredTable table = parse_text_table(text, "run.csv");
    ASSERT_EQ(table.columns.size(), 2u) << text;
    EXPECT_EQ(table.columns[0].name, "t") << text;
    EXPECT_EQ(table.columns[1].name, "q") << text;
    ASSERT_EQ(table.rows(), 2u) << text;
    EXPECT_EQ(table.columns[1].value[0], 1.5) << text;
    EXPECT_EQ(table.columns[1].value[1], -2e-3) << text;
  }
}

TEST(MeasuredTable, APipeIsRefusedAndNotWaitedFor) {
  const Scratch folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(read_measured_table(pipe, {}), MeasurementError);
}

TEST(MeasuredTable, WithoutHeadingsColumnsAreCalledByTheirNumbers) {
  const MeasuredTable table = parse_text_table("1,2\n3,4\n", "run.csv");
  EXPECT_EQ(table.columns[1].name, "2");
  EXPECT_EQ(table.rows(), 2u);
  // A remark with quotes of its own names nothing.
  const MeasuredTable remarked =
      parse_text_table("# \"S piece\" second lap\n1,2\n3,4\n", "run.csv");
  EXPECT_EQ(remarked.columns[1].name, "2");
  EXPECT_EQ(remarked.rows(), 2u);
}

TEST(MeasuredTable, WhatIsMissingIsNaNAndWhatIsNoNumberIsRemembered) {
  const MeasuredTable table = parse_text_table("t,q,note\n0,,go\n1,nan,go\n2,-9999,\n3,4,go\n",
                                               "run.csv", {.missing = {"-9999"}});
  ASSERT_EQ(table.rows(), 4u);
  for (const std::size_t k : {0u, 1u, 2u}) EXPECT_TRUE(std::isnan(table.columns[1].value[k])) << k;
  EXPECT_EQ(table.columns[1].value[3], 4);
  EXPECT_EQ(table.columns[1].bad_line, 0u);
  EXPECT_EQ(table.columns[2].bad_line, 2u);
  EXPECT_EQ(table.columns[2].bad_text, "go");
}

TEST(MeasuredTable, DecimalCommasAreReadWhereTheMapSaysSo) {
  const TextFormat commas{.decimal = ImportMap::Decimal::comma};
  for (const char* text : {"t;q\n0;-1,5\n1;2,5e-3\n", "sep=;\nt;q\ns;um\n0;-1,5\n1;2,5e-3\n",
                           "t\tq\n0\t-1,5\n1\t2,5e-3\n", "t q\n0 -1,5\n1 2,5e-3\n"}) {
    const MeasuredTable table = parse_text_table(text, "run.csv", commas);
    ASSERT_EQ(table.columns.size(), 2u) << text;
    ASSERT_EQ(table.rows(), 2u) << text;
    EXPECT_EQ(table.columns[1].name, "q") << text;
    EXPECT_EQ(table.columns[1].value[0], -1.5) << text;
    EXPECT_EQ(table.columns[1].value[1], 2.5e-3) << text;
  }
  EXPECT_EQ(parse_text_table("t;q\n0;1.000,5\n1;2\n", "run.csv", commas).columns[1].bad_text,
            "1.000,5");
  EXPECT_THROW(parse_text_table("t,q\n0,1\n", "run.csv",
                                {.separator = ImportMap::Separator::comma,
                                 .decimal = ImportMap::Decimal::comma}),
               MeasurementError);
}

TEST(MeasuredTable, CommasThatAreNoDecimalsAreSaidWithTheirLine) {
  const TextFormat commas{.decimal = ImportMap::Decimal::comma};
  const auto said = [&](const std::string& text) {
    try {
      parse_text_table(text, "run.csv", commas);
    } catch (const MeasurementError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(said("t,q\n0,1.5\n1,2.5\n"),
            "run.csv:3: \"1,2.5\" is one value where commas begin decimals, as the map says "
            "(decimal = \"comma\"): values must be separated by semicolons, tabs or spaces then");
  EXPECT_EQ(said("t;q\n0.5;1.5\n"),
            "run.csv:2: \"0.5\" has a decimal point; the map says decimal = \"comma\"");
  EXPECT_EQ(said("t;q\n0,5;1,5\n"), "");
}

TEST(MeasuredTable, ALineOfASpreadsheetTellsTheSeparator) {
  const MeasuredTable table = parse_text_table("sep=;\nt;q, of X\n0;1\n1;2\n", "run.csv");
  ASSERT_EQ(table.columns.size(), 2u);
  EXPECT_EQ(table.columns[1].name, "q, of X");
  EXPECT_EQ(table.line.front(), 3u);
}

TEST(MeasuredTable, ARowOfUnitsIsKeptBesideTheNames) {
  const MeasuredTable table = parse_text_table("t;q\nms;um\n0;1\n1;2\n", "run.csv");
  ASSERT_EQ(table.columns.size(), 2u);
  EXPECT_EQ(table.columns[0].unit, "ms");
  EXPECT_EQ(table.columns[1].unit, "um");
  EXPECT_EQ(table.rows(), 2u);
  EXPECT_EQ(parse_text_table("t;q\n0;1\n", "run.csv").columns[1].unit, "");
}

TEST(MeasuredTable, RefusesWithLineAndReason) {
  EXPECT_NE(refusal("t;q\n0;1,5\n")
                .find("run.csv:2: \"1,5\" in column \"q\" has a decimal comma; if all "
                      "numbers have, say so in the map: decimal = \"comma\""),
            std::string::npos)
      << refusal("t;q\n0;1,5\n");
  EXPECT_NE(refusal("t,q\n0,0,1,5\n")
                .find("run.csv:2: 4 values, expected 2; if the numbers have "
                      "decimal commas"),
            std::string::npos);
  EXPECT_NE(refusal("t,q\n0,1\n2\n").find("run.csv:3: 1 values, expected 2"), std::string::npos);
  EXPECT_NE(
      refusal("Report of machine\nt,q\n0,1\n").find("run.csv:3: 1 values, expected 3; remarks"),
      std::string::npos);
  EXPECT_NE(refusal("t,q\n0,\"1\n").find("run.csv:2: a quote is not closed"), std::string::npos);
  EXPECT_NE(refusal("t,q\r0,1\r").find("run.csv:1: lines end with a carriage return alone"),
            std::string::npos);
  EXPECT_NE(refusal("t,q\n").find("holds no numbers"), std::string::npos);
  EXPECT_NE(refusal("").find("holds no numbers"), std::string::npos);
  try {
    parse_text_table("t,q,f\n0,1.5,2\n", "run.csv", {.separator = ImportMap::Separator::semicolon});
    FAIL() << "one column of text";
  } catch (const MeasurementError& e) {
    EXPECT_NE(std::string(e.what()).find("one value each, divided by ';'"), std::string::npos)
        << e.what();
  }
}

MeasuredTable numbered(std::size_t rows) {
  MeasuredTable table{.source = "run.csv", .columns = {}, .line = {}};
  for (std::size_t i = 0; i < rows; ++i) table.line.push_back(i + 2);
  return table;
}

TEST(TimeBaseOfStamps, IsTheGridWithItsGapsAndItsJitter) {
  std::vector<double> time;
  for (int k = 0; k < 1000; ++k)
    if (k < 300 || k >= 305) time.push_back(5 + 1e-3 * k + 20e-6 * (k % 2 == 0 ? 1 : -1));
  const TimeBase base = time_base(time, 0.2, numbered(time.size()));
  EXPECT_NEAR(base.period, 1e-3, 1e-9);
  EXPECT_EQ(base.samples, 1000u);
  EXPECT_EQ(base.gaps, 1u);
  EXPECT_EQ(base.lost, 5u);
  EXPECT_EQ(base.index[300], 305u);
  EXPECT_NEAR(base.jitter, 20e-6, 1e-6);  // the rms of +-20 us is 20 us
  EXPECT_NEAR(base.begin, 5, 1e-6);
}

TEST(TimeBaseOfStamps, FindsTheGridOfStampsThatJitterByNearlyHalfOfIt) {
  std::mt19937 random(5);
  std::vector<double> time;
  for (int k = 0; k < 20000; ++k)
    time.push_back(3 + 1e-3 * (k + 0.9 * (static_cast<double>(random()) / 4294967296.0 - 0.5)));
  const TimeBase base = time_base(time, 0.49, numbered(time.size()));
  EXPECT_NEAR(base.period, 1e-3, 1e-8);
  EXPECT_EQ(base.samples, 20000u);
  EXPECT_EQ(base.lost, 0u);
}

TEST(TimeBaseOfStamps, RefusesTimeThatFitsNoGrid) {
  const auto why = [](const std::vector<double>& time) -> std::string {
    try {
      time_base(time, 0.2, numbered(time.size()));
    } catch (const MeasurementError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(why({0, 1, 2, 2, 3}).find("run.csv:5: time does not increase"), std::string::npos);
  EXPECT_NE(why({0, 1, 2, 1.5}).find("run.csv:5: time does not increase"), std::string::npos);
  std::vector<double> uneven;
  for (int k = 0; k < 100; ++k) uneven.push_back(1e-3 * k + 0.3e-3 * std::sin(0.7 * k));
  EXPECT_NE(why(uneven).find("time is not uniform"), std::string::npos);
  std::vector<double> growing;
  for (int k = 0; k < 100; ++k) growing.push_back(std::exp(0.2 * k));
  EXPECT_NE(why(growing).find("time fits no uniform grid"), std::string::npos);
  EXPECT_NE(why({0, std::nan(""), 2}).find("the time is missing"), std::string::npos);
}

}  // namespace
}  // namespace vcnc::measured_table_test
