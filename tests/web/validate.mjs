// Runs the Khronos glTF-Validator on files: node validate.mjs [--strict] FILE...
//
// Exit status: 0 no error and no warning (with --strict: no information and no hint either), 1 otherwise, 77 when the
// validator is not installed (npm install in this folder).
import { readFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';

let validator;
try {
  validator = (await import('gltf-validator')).default;
} catch {
  console.log('skipped: gltf-validator is not installed');
  process.exit(77);
}

const severities = ['error', 'warning', 'information', 'hint'];
const strict = process.argv.includes('--strict');
const files = process.argv.slice(2).filter((argument) => argument !== '--strict');
if (files.length === 0) {
  console.error('validate.mjs: which files?');
  process.exit(1);
}

const totals = [0, 0, 0, 0];
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: file,
    maxIssues: 20,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
  });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  [numErrors, numWarnings, numInfos, numHints].forEach((count, severity) => (totals[severity] += count));
  for (const { severity, code, message, pointer } of messages) {
    console.log(`${file}: ${severities[severity]} ${code} at ${pointer ?? '-'}: ${message}`);
  }
}
console.log(`${files.length} files: ` + totals.map((count, severity) => `${count} ${severities[severity]}`).join(', '));
process.exit(totals[0] + totals[1] + (strict ? totals[2] + totals[3] : 0) === 0 ? 0 : 1);
