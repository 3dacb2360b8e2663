// Shows one version of a table at a time, chosen from a list, and the details of a cell beside the cell that has the pointer
// or the focus.
for (const table of document.querySelectorAll('.paper-table')) {
  const versions = [...table.querySelectorAll(':scope > .version')];
  if (versions.length < 2) continue;
  const choice = document.createElement('select');
  choice.setAttribute('aria-label', 'Procedure and data');
  versions.forEach((version, i) => choice.add(new Option(version.dataset.name, i)));
  const show = () => versions.forEach((version, i) => { version.hidden = i !== choice.selectedIndex; });
  choice.addEventListener('change', show);
  versions[0].before(choice);
  show();
}
const tip = document.createElement('div');
tip.className = 'tip';
tip.setAttribute('role', 'status');
tip.hidden = true;
document.body.append(tip);
for (const cell of document.querySelectorAll('.paper-table td[title]')) {
  cell.dataset.tip = cell.title;
  cell.setAttribute('aria-description', cell.title);
  cell.removeAttribute('title');
  const show = () => {
    const box = cell.getBoundingClientRect();
    tip.textContent = cell.dataset.tip;
    tip.hidden = false;
    tip.style.left = Math.max(4, Math.min(box.left, innerWidth - tip.offsetWidth - 4)) + 'px';
    const below = box.bottom + 4;
    tip.style.top = (below + tip.offsetHeight > innerHeight ? box.top - tip.offsetHeight - 4 : below) + 'px';
  };
  const hide = () => { tip.hidden = true; };
  cell.addEventListener('mouseenter', show);
  cell.addEventListener('focus', show);
  cell.addEventListener('mouseleave', hide);
  cell.addEventListener('blur', hide);
}
addEventListener('keydown', event => { if (event.key === 'Escape') tip.hidden = true; });
