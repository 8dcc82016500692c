#include "codegen/llvm/archive.h"

#include <llvm/Object/ArchiveWriter.h>
#include <llvm/Support/MemoryBuffer.h>

#include "diagnostics/error.h"

namespace retrograde::codegen {

std::string archive(const std::vector<Member>& members) {
  std::vector<llvm::NewArchiveMember> parts;
  for (const Member& member : members)
    parts.emplace_back(llvm::MemoryBufferRef(member.contents, member.name));
  auto buffer = llvm::writeArchiveToBuffer(parts, llvm::SymtabWritingMode::NormalSymtab,
                                           llvm::object::Archive::K_GNU, /*Deterministic=*/true,
                                           /*Thin=*/false);
  if (!buffer) internal_error("writing an archive: " + llvm::toString(buffer.takeError()));
  return (*buffer)->getBuffer().str();
}

}  // namespace retrograde::codegen
