// SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
// SPDX-License-Identifier: Apache-2.0

// Searches the site as its own pages do:  node search.cjs SITE WORDS...
// Prints, as JSON, a list of pages for each search, the best first.
const fs = require('fs');
const path = require('path');
const vm = require('vm');

const [site, ...searches] = process.argv.slice(2);
const workers = path.join(site, 'assets', 'javascripts', 'workers');
const script = fs.readdirSync(workers).find(name => name.endsWith('.js'));

// What a browser gives to a worker.
let listener, answered;
const worker = {
  console,
  addEventListener: (_, heard) => { listener = heard; },
  postMessage: message => answered(message),
};
worker.self = worker;
vm.runInContext(fs.readFileSync(path.join(workers, script), 'utf8'), vm.createContext(worker));

const ask = data => new Promise(resolve => {
  answered = resolve;
  listener({ data });
});

(async () => {
  const index = JSON.parse(fs.readFileSync(path.join(site, 'search', 'search_index.json')));
  await ask({ type: 0, data: { ...index, options: { suggest: true } } });
  const found = [];
  for (const words of searches) {
    const { data } = await ask({ type: 2, data: words });
    found.push(data.items.map(([best]) => best.location.split('#')[0]));
  }
  console.log(JSON.stringify(found));
})();
