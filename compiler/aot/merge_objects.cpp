// merge_objects -- merges relocatable ELF objects into one, without a linker.
//
// Sections stay separate, even if they have the same name: a linker merges them later. Sections and symbols are
// renumbered, and everything that refers to them by number (relocations, groups, headers) is rewritten. Global symbols
// with the same name become one; symbols that are hidden between the parts of one program become local.
//
// Source: System V ABI, chapter 4. Only 64-bit little-endian objects are supported, as x86-64 and AArch64 have.
#include "aot/merge_objects.h"

#include <elf.h>

#include <cstring>
#include <map>
#include <vector>

#include "diagnostics/error.h"

namespace retrograde::aot {
namespace {

// This section holds symbol numbers for linkers that fold identical code. It is optional and is dropped.
constexpr uint32_t llvm_address_significance = 0x6fff4c03;

struct Section {
  Elf64_Shdr header;
  std::string name, data;
};
struct NamedSymbol {
  Elf64_Sym entry;
  std::string name;
  bool is_local() const { return ELF64_ST_BIND(entry.st_info) == STB_LOCAL; }
  bool is_weak() const { return ELF64_ST_BIND(entry.st_info) == STB_WEAK; }
  bool is_defined() const { return entry.st_shndx != SHN_UNDEF; }
};

template <typename T>
T read_at(const std::string& bytes, size_t offset) {
  RETROGRADE_ASSERT(offset + sizeof(T) <= bytes.size(), "an object file ends early");
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}
template <typename T>
void write_at(std::string& bytes, size_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}
template <typename T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// A parsed object.
struct Object {
  Elf64_Ehdr header;
  std::vector<Section> sections;
  std::vector<NamedSymbol> symbols;
  std::vector<bool>
      is_kept;  // of sections: false for the symbol and string tables, which are rebuilt

  explicit Object(const std::string& bytes) : header(read_at<Elf64_Ehdr>(bytes, 0)) {
    RETROGRADE_ASSERT(std::memcmp(header.e_ident, ELFMAG, SELFMAG) == 0 &&
                          header.e_ident[EI_CLASS] == ELFCLASS64 &&
                          header.e_ident[EI_DATA] == ELFDATA2LSB && header.e_type == ET_REL &&
                          header.e_shnum > 0,
                      "an object file of another format");
    read_sections(bytes);
    read_symbols();
  }

 private:
  void read_sections(const std::string& bytes) {
    for (size_t i = 0; i < header.e_shnum; i++) {
      const auto section = read_at<Elf64_Shdr>(bytes, header.e_shoff + i * sizeof(Elf64_Shdr));
      const bool has_data = section.sh_type != SHT_NOBITS && section.sh_type != SHT_NULL;
      sections.push_back(
          {section, "",
           has_data ? bytes.substr(section.sh_offset, section.sh_size) : std::string()});
    }
    const std::string& names = sections.at(header.e_shstrndx).data;
    for (Section& section : sections) section.name = names.c_str() + section.header.sh_name;
    is_kept.assign(sections.size(), true);
    is_kept[0] = is_kept[header.e_shstrndx] = false;
  }

  void read_symbols() {
    for (size_t i = 0; i < sections.size(); i++) {
      const Section& section = sections[i];
      if (section.header.sh_type == llvm_address_significance) is_kept[i] = false;
      if (section.header.sh_type != SHT_SYMTAB) continue;
      is_kept[i] = is_kept.at(section.header.sh_link) = false;
      const std::string& names = sections[section.header.sh_link].data;
      for (size_t at = 0; at < section.data.size(); at += sizeof(Elf64_Sym)) {
        const auto symbol = read_at<Elf64_Sym>(section.data, at);
        symbols.push_back({symbol, names.c_str() + symbol.st_name});
      }
    }
  }
};

class Merger {
 public:
  std::string merge(std::vector<Object> parts, bool are_of_one_program) {
    sections_.push_back({});
    symbols_.push_back({});
    for (Object& part : parts) number_sections(part);
    const auto each = [&](const auto& step) {
      for (size_t i = 0; i < parts.size(); i++) step(parts[i], numbers_[i]);
    };
    each([&](const Object& part, Numbers& numbers) { add_locals(part, numbers); });
    if (are_of_one_program)
      each([&](const Object& part, Numbers& numbers) { add_shared(part, numbers); });
    first_global_ = symbols_.size();
    each([&](const Object& part, Numbers& numbers) { add_globals(part, numbers); });
    symbol_table_ = static_cast<uint32_t>(sections_.size());
    each([&](const Object& part, Numbers& numbers) { rewrite_references(part, numbers); });
    add_symbol_table();
    return write(parts[0].header);
  }

 private:
  struct Numbers {
    std::vector<uint32_t> section, symbol;  // old number -> new number
  };
  std::vector<Section> sections_;
  std::vector<NamedSymbol> symbols_;
  std::vector<Numbers> numbers_;
  std::map<std::string, uint32_t> globals_;  // global symbols, and former ones that the parts share
  size_t first_global_ = 0;
  uint32_t symbol_table_ = 0;

  void number_sections(Object& part) {
    Numbers numbers;
    for (size_t i = 0; i < part.sections.size(); i++) {
      numbers.section.push_back(part.is_kept[i] ? static_cast<uint32_t>(sections_.size()) : 0);
      if (part.is_kept[i]) sections_.push_back(std::move(part.sections[i]));
    }
    numbers.symbol.resize(part.symbols.size());
    numbers_.push_back(std::move(numbers));
  }

  static NamedSymbol renumbered(NamedSymbol symbol, const Numbers& numbers) {
    if (symbol.is_defined() && symbol.entry.st_shndx < SHN_LORESERVE)
      symbol.entry.st_shndx = static_cast<uint16_t>(numbers.section.at(symbol.entry.st_shndx));
    return symbol;
  }

  void add_locals(const Object& part, Numbers& numbers) {
    for (size_t i = 1; i < part.symbols.size(); i++) {
      if (!part.symbols[i].is_local()) continue;
      numbers.symbol[i] = static_cast<uint32_t>(symbols_.size());
      symbols_.push_back(renumbered(part.symbols[i], numbers));
    }
  }

  // Adds the symbols that a part defines only for other parts, as local symbols.
  void add_shared(const Object& part, Numbers& numbers) {
    for (size_t i = 1; i < part.symbols.size(); i++) {
      NamedSymbol symbol = renumbered(part.symbols[i], numbers);
      const bool is_hidden = ELF64_ST_VISIBILITY(symbol.entry.st_other) == STV_HIDDEN;
      if (symbol.is_local() || !symbol.is_defined() || !is_hidden) continue;
      symbol.entry.st_info = ELF64_ST_INFO(STB_LOCAL, ELF64_ST_TYPE(symbol.entry.st_info));
      symbol.entry.st_other = STV_DEFAULT;
      globals_.emplace(symbol.name, static_cast<uint32_t>(symbols_.size()));
      symbols_.push_back(std::move(symbol));
    }
  }

  void add_globals(const Object& part, Numbers& numbers) {
    for (size_t i = 1; i < part.symbols.size(); i++) {
      if (part.symbols[i].is_local()) continue;
      const NamedSymbol symbol = renumbered(part.symbols[i], numbers);
      const auto [found, is_new] =
          globals_.emplace(symbol.name, static_cast<uint32_t>(symbols_.size()));
      numbers.symbol[i] = found->second;
      if (is_new)
        symbols_.push_back(symbol);
      else if (found->second >= first_global_ && goes_before(symbol, symbols_[found->second]))
        symbols_[found->second] = symbol;
    }
  }
  static bool goes_before(const NamedSymbol& a, const NamedSymbol& b) {
    if (a.is_defined() != b.is_defined()) return a.is_defined();
    return b.is_weak() && !a.is_weak();
  }

  // Rewrites headers that refer to other sections, and contents that refer to sections or symbols.
  void rewrite_references(const Object& part, const Numbers& numbers) {
    for (size_t i = 0; i < part.sections.size(); i++) {
      if (!part.is_kept[i]) continue;
      Section& section = sections_[numbers.section[i]];
      switch (section.header.sh_type) {
        case SHT_RELA:
          section.header.sh_link = symbol_table_;
          section.header.sh_info = numbers.section.at(section.header.sh_info);
          rewrite_relocations(section.data, numbers);
          break;
        case SHT_GROUP:
          section.header.sh_link = symbol_table_;
          section.header.sh_info = numbers.symbol.at(section.header.sh_info);
          for (size_t at = sizeof(Elf64_Word); at < section.data.size(); at += sizeof(Elf64_Word)) {
            const auto member = read_at<Elf64_Word>(section.data, at);
            write_at<Elf64_Word>(section.data, at, numbers.section.at(member));
          }
          break;
        default:
          section.header.sh_link = numbers.section.at(section.header.sh_link);
      }
    }
  }
  static void rewrite_relocations(std::string& data, const Numbers& numbers) {
    for (size_t at = 0; at < data.size(); at += sizeof(Elf64_Rela)) {
      auto relocation = read_at<Elf64_Rela>(data, at);
      const uint64_t symbol = numbers.symbol.at(ELF64_R_SYM(relocation.r_info));
      relocation.r_info = ELF64_R_INFO(symbol, ELF64_R_TYPE(relocation.r_info));
      write_at(data, at, relocation);
    }
  }

  void add_symbol_table() {
    std::string names(1, '\0'), table;
    for (NamedSymbol& symbol : symbols_) {
      symbol.entry.st_name = symbol.name.empty() ? 0 : static_cast<uint32_t>(names.size());
      if (!symbol.name.empty()) names += symbol.name + '\0';
      append(table, symbol.entry);
    }
    Elf64_Shdr header{};
    header.sh_type = SHT_SYMTAB;
    header.sh_link = symbol_table_ + 1;
    header.sh_info = static_cast<uint32_t>(first_global_);
    header.sh_addralign = 8;
    header.sh_entsize = sizeof(Elf64_Sym);
    sections_.push_back({header, ".symtab", table});
    sections_.push_back({table_of_text(), ".strtab", names});
  }
  static Elf64_Shdr table_of_text() {
    Elf64_Shdr header{};
    header.sh_type = SHT_STRTAB;
    header.sh_addralign = 1;
    return header;
  }

  std::string write(Elf64_Ehdr header) {
    std::string names(1, '\0');
    sections_.push_back({table_of_text(), ".shstrtab", ""});
    for (Section& section : sections_) {
      section.header.sh_name = section.name.empty() ? 0 : static_cast<uint32_t>(names.size());
      if (!section.name.empty()) names += section.name + '\0';
    }
    sections_.back().data = names;

    std::string bytes(sizeof(Elf64_Ehdr), '\0');
    const auto align = [&](uint64_t to) {
      while (to > 1 && bytes.size() % to != 0) bytes += '\0';
    };
    for (Section& section : sections_) {
      align(section.header.sh_addralign);
      section.header.sh_offset = section.header.sh_type == SHT_NULL ? 0 : bytes.size();
      const bool has_data =
          section.header.sh_type != SHT_NOBITS && section.header.sh_type != SHT_NULL;
      if (has_data) section.header.sh_size = section.data.size();
      bytes += section.data;
    }
    align(alignof(Elf64_Shdr));
    RETROGRADE_ASSERT(sections_.size() < SHN_LORESERVE, "an object of too many sections");
    header.e_shoff = bytes.size();
    header.e_shnum = static_cast<uint16_t>(sections_.size());
    header.e_shstrndx = static_cast<uint16_t>(sections_.size() - 1);
    for (const Section& section : sections_) append(bytes, section.header);
    write_at(bytes, 0, header);
    return bytes;
  }
};

}  // namespace

std::string merge_objects(const std::string& object, const std::string& library) {
  std::vector<Object> parts{Object(object), Object(library)};
  RETROGRADE_ASSERT(parts[0].header.e_machine == parts[1].header.e_machine,
                    "objects of two architectures");
  for (NamedSymbol& symbol : parts[1].symbols) {
    if (symbol.is_local() || !symbol.is_defined()) continue;
    symbol.entry.st_info = ELF64_ST_INFO(STB_WEAK, ELF64_ST_TYPE(symbol.entry.st_info));
  }
  return Merger().merge(std::move(parts), /*are_of_one_program=*/false);
}

std::string join_parts(const std::vector<std::string>& parts) {
  if (parts.size() == 1) return parts[0];
  return Merger().merge({parts.begin(), parts.end()}, /*are_of_one_program=*/true);
}

}  // namespace retrograde::aot
